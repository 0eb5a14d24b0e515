def drawing():
    return ""


def shown(text, docname):
    return text
