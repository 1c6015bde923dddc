"""Clause 9: classes, codes and the exception that carries them."""

# SS-ER-006
EXIT_CODE = {"malformed": 10, "invalid": 11, "unsupported": 12, "over-limit": 13, "truncated": 14}

CLASS_OF = {
    "TRUNCATED": "truncated",
    "SIGNATURE": "malformed",
    "CHECKSUM": "malformed",
    "SHORT_SECTION": "malformed",
    "TRAILING_BYTES": "malformed",
    "NUMBER": "malformed",
    "PADDING": "malformed",
    "ENTROPY_FINAL_STATE": "malformed",
    "RESERVED_BITS": "unsupported",
    "RESERVED": "unsupported",
    "OUT_OF_RANGE": "invalid",
    "MISMATCH": "invalid",
    "CONSTRAINT": "invalid",
    "UNEXPECTED_UNIT": "invalid",
    "UNDEFINED": "invalid",
    "DIGEST": "invalid",
    "OVER_LIMIT": "over-limit",
}


class StreamError(Exception):
    """An error of clause 9: code, clause of the broken rule, byte offset in the stream."""

    def __init__(self, code, clause, byte):
        super().__init__("%s (%s) at byte %d" % (code, clause, byte))
        self.code = code
        self.clause = clause
        self.byte = byte
        self.of_carried = False                     # SS-DG-005: a decoder that shows subsets does not look for it

    @property
    def error_class(self):
        return CLASS_OF[self.code]

    def as_dict(self):
        return {"class": self.error_class, "code": self.code,
                "clause": self.clause, "byte": self.byte}


def require(condition, code, clause, byte):
    if not condition:
        raise StreamError(code, clause, byte)
