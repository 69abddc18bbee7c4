"""What pickles of models name: a function of Python, as pickle wants it."""


def model(data: bytes) -> object:
    from ._btfield import from_bytes

    return from_bytes(data)
