"""What is raised where a process in which something was computed is no more."""


class Lost(Exception):
    """A call that came to no result. `code` is a key of errors.FAILURES, `cause` says what happened."""

    advice = ""

    def __init__(self, code: str, cause: str) -> None:
        self.code, self.cause = code, cause
        super().__init__(cause)
