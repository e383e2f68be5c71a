"""Changes files at random: bytes, numbers, names, parts of lines and of elements."""

import random
import re
from collections.abc import Callable

NUMBERS = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-308", b"0", b"-0.0", b"-1", b"1", b"2",
    b"0.5", b"1e9", b"-1e9", b"1e18", b"2147483648", b"4294967296", b"99999999999999999999", b"1e5",
    b"", b"x", b"0x10", b"1_000", b"1,5", b"\xc2\xb2", b"true", b"null", b"[]", b"{}", b"1 2",
)  # fmt: skip
"""What stands in place of a number."""
WORDS = (
    b"", b" ", b"..", b"../../etc/passwd", b"/etc/passwd", b"\x00", b"%s%n", b"&amp;", b"&#0;",
    b"\xff\xfe", b"\xe2\x80\xae", b"A" * 5000, b"'", b'"', b"<", b">", b"]]>", b"#", b"\n", b"\\",
    b"http://127.0.0.1:1/x", b"file:///etc/passwd", b"none", b"self", b"-1", b"{", b"}", b"$x",
)  # fmt: skip
"""What stands in place of a text in quotes."""
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_QUOTED = re.compile(rb'"[^"\n]*"')
_ELEMENT = re.compile(rb"<[A-Za-z][^<>]*/>|<([A-Za-z][\w:]*)[^<>]*>[^<>]*</\1>")
Change = Callable[[bytes, random.Random], bytes]


def changed(data: bytes, rng: random.Random) -> bytes:
    """A copy with one to six changes, of which most keep the syntax of a text."""
    is_text = b"\x00" not in data[:4096]
    changes = _OF_TEXT if is_text and rng.random() < 0.9 else _OF_BYTES
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        data = rng.choice(changes)(data, rng)
    return data


def _replace(pattern: re.Pattern[bytes], words: tuple[bytes, ...], quoted: bool) -> Change:
    def change(data: bytes, rng: random.Random) -> bytes:
        places = [match.span() for match in pattern.finditer(data)]
        if not places:
            return data
        first, last = rng.choice(places)
        word = rng.choice(words)
        return data[:first] + (b'"' + word + b'"' if quoted else word) + data[last:]

    return change


def _scale_number(data: bytes, rng: random.Random) -> bytes:
    """Changes a number by a factor or a little, so that it stays plausible."""
    places = [match.span() for match in _NUMBER.finditer(data)]
    if not places:
        return data
    first, last = rng.choice(places)
    value = float(data[first:last]) * rng.choice((-1.0, 0.0, 0.1, 10.0, 1000.0, 1.0 + 1e-9))
    return data[:first] + repr(value).encode() + data[last:]


def _elements(data: bytes, rng: random.Random) -> bytes:
    """Removes, repeats or exchanges elements without children."""
    places = [match.span() for match in _ELEMENT.finditer(data)]
    if len(places) < 2:
        return data
    (first, last), (begin, end) = sorted(rng.sample(places, 2))
    kind = rng.randrange(3)
    if kind == 0:
        return data[:first] + data[last:]
    if kind == 1:
        return data[:begin] + data[first:last] * rng.choice((1, 2, 50)) + data[begin:]
    return data[:first] + data[begin:end] + data[last:begin] + data[first:last] + data[end:]


def _lines(data: bytes, rng: random.Random) -> bytes:
    """Removes, repeats or exchanges lines."""
    lines = data.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(3)
    if kind == 0:
        del lines[one]
    elif kind == 1:
        lines[one:one] = [lines[other]] * rng.choice((1, 2, 20))
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _drop(data: bytes, rng: random.Random) -> bytes:
    first = rng.randrange(len(data) + 1)
    return data[:first] + data[first + rng.choice((1, 4, 64, 1024)) :]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    first = rng.randrange(len(data) + 1)
    part = data[first : first + rng.choice((1, 16, 512))]
    return data[:first] + part * rng.choice((2, 3, 100)) + data[first:]


def _flip(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 8)) if data else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwrite(data: bytes, rng: random.Random) -> bytes:
    size = rng.choice((1, 2, 4, 8))
    first = rng.randrange(max(len(data) - size, 0) + 1)
    word = rng.choice((b"\xff" * size, bytes(size), rng.randbytes(size), b"\x7f" + b"\xff" * 7))
    return data[:first] + word[:size] + data[first + size :]


_OF_BYTES: tuple[Change, ...] = (_flip, _flip, _overwrite, _overwrite, _cut, _drop, _repeat)
_OF_TEXT: tuple[Change, ...] = (
    *(_replace(_NUMBER, NUMBERS, quoted=False),) * 3,
    _replace(_QUOTED, WORDS, quoted=True),
    _replace(_QUOTED, NUMBERS, quoted=True),
    *(_scale_number,) * 2,
    *(_elements,) * 3,
    _lines,
    _cut,
    _drop,
    _flip,
)
