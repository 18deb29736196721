"""The errors of the byte layer: one base, and what a caller can tell apart."""


class TransportError(Exception):
    """Base of all errors of `transports`; the text names the link and says what to do."""


class LinkError(TransportError):
    """The link cannot be opened, or it closed; nothing more can be sent on it."""


class NoAnswer(TransportError):  # noqa: N818 - what happened, in the words of the field
    """No complete answer came before the deadline."""


class WrongAnswer(TransportError):  # noqa: N818 - likewise
    """An answer came that is not the answer to this request."""


class ExceptionReply(TransportError):  # noqa: N818 - Modbus calls it that
    """The device understood the request and refused it.

    Attributes
    ----------
    code : int
        The Modbus exception code.
    """

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code
