"""Exceptions of lodestone; the compiled module raises them."""


class Error(Exception):
    """What every error of lodestone is. Its text is one line: the place, what is wrong, what to do."""


class UsageError(Error, ValueError):
    """An argument is wrong."""


class FormatError(Error, ValueError):
    """Bad input or an unreadable asset."""


class InvariantError(Error):
    """A structure or a comparison is not as it must be."""


class MachineError(Error, OSError):
    """Memory, device, disk or driver cannot."""


class Interrupted(Error):
    """The work was stopped."""
