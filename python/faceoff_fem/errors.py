"""What can go wrong: every error says what, where, and what to do."""


class Error(Exception):
    """What faceoff refuses.

    Attributes: ``what`` is wrong, ``where`` (a file with line or byte, a mesh, a scene; may be empty), and the ``remedy``.
    """

    def __init__(self, message, what="", where="", remedy=""):
        super().__init__(message)
        self.what = what
        self.where = where
        self.remedy = remedy

    def __str__(self):
        return str(self.args[0])

    def __reduce__(self):
        return type(self), (self.args[0], self.what, self.where, self.remedy)


class FileError(Error, OSError):
    """A file that cannot be read or written, or that violates its format."""


class UsageError(Error, ValueError):
    """Arguments that ask for something impossible."""


def usage(what, remedy, where=""):
    """The error for arguments."""
    at = f"{where}: " if where else ""
    return UsageError(f"{at}{what}; {remedy}", what, where, remedy)
