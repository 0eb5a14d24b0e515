"""Notes: warnings about what is likely not meant, or was decided for the user."""

from rft.core.refusal import spell_arguments


class Note(UserWarning):
    """A warning that stops nothing; on the command line a line on standard error.

    It names arguments as a `Refusal` does, in double backticks, which ``args[0]``
    keeps."""

    def __str__(self) -> str:
        return spell_arguments(str(self.args[0]))
