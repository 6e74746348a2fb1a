"""Where `stickslip.records.files` was before others needed it, too."""

from stickslip.records.files import PARTIAL, discard, is_remains, put_aside, write_whole

__all__ = ["PARTIAL", "discard", "is_remains", "put_aside", "write_whole"]
