def table():
    return ""


def shown(text, docname):
    return text
