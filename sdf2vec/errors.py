"""The one exception that users meet: a single line that says what is wrong and what to do."""


class Sdf2vecError(ValueError):
    """Bad input or a failed write. The message is one line, fit to be shown to a user as it is."""


class Sdf2vecWarning(RuntimeWarning):
    """What a user should know, though the work goes on. The message is one line."""
