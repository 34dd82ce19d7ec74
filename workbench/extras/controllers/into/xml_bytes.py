"""XML elements with their places in the file, to the byte, and edits of their numbers."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np

from workbench.arm.urdf_writer import numbers_text
from workbench.base.errors import FileError

FILE = "the file of --into"
START_TAG = re.compile(rb"<([^\s/>]+)(?:[^\"'>]|\"[^\"]*\"|'[^']*')*>")
ATTRIBUTE = re.compile(rb"\s([^\s=]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")


@dataclass(frozen=True)
class Edit:
    """Bytes from `start` to `stop` that are replaced."""

    start: int
    stop: int
    new: bytes


@dataclass(frozen=True, eq=False)
class XmlElement:
    """One element: its start tag from `start` to `inside`, its contents to `stop` [bytes]."""

    data: bytes
    tag: str
    attrib: dict[str, str]
    line: int
    start: int
    inside: int
    parent: "XmlElement | None"
    children: list["XmlElement"] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    @property
    def stop(self) -> int:
        """Where the contents end [bytes]."""
        return self.ends[0]

    @property
    def is_open(self) -> bool:
        """Whether it has an end tag."""
        return not self.data.endswith(b"/>", self.start, self.inside)

    def iter(self, *tags: str) -> Iterator["XmlElement"]:
        """This element and all inside it, in the order of the file."""
        if not tags or self.tag in tags:
            yield self
        for child in self.children:
            yield from child.iter(*tags)

    def find(self, tag: str) -> "XmlElement | None":
        return next((c for c in self.children if c.tag == tag), None)

    @property
    def text(self) -> str:
        """The contents, comments left out."""
        return (
            re.sub(rb"<!--.*?-->", b"", self.data[self.inside : self.stop], flags=re.DOTALL).decode().strip()
        )

    def with_attribute(self, name: str, numbers: np.ndarray) -> Edit:
        """An attribute with other numbers; added where there is none."""
        new = numbers_text(numbers).encode()
        tag_end = self.start + 1 + len(self.tag.encode())
        for found in ATTRIBUTE.finditer(self.data, tag_end, self.inside):
            if found[1].decode() == name:
                return Edit(*found.span(2 if found[2] is not None else 3), new)
        return Edit(tag_end, tag_end, b' %s="%s"' % (name.encode(), new))

    def with_text(self, numbers: np.ndarray) -> Edit:
        """Other numbers as the contents; an empty element `<pose/>` is opened for them."""
        new = numbers_text(numbers).encode()
        if not self.is_open:
            return Edit(self.inside - 2, self.inside, b">%s</%s>" % (new, self.tag.encode()))
        return Edit(self.inside, self.stop, new)

    def with_child(self, text: str) -> Edit:
        return Edit(self.inside, self.inside, text.encode())

    def numbers(self, text: str, *counts: int) -> np.ndarray:
        try:
            found = np.array([float(v) for v in text.split()])
            if len(found) in counts and np.isfinite(found).all():
                return found
        except ValueError:
            pass
        wanted = " or ".join(map(str, counts))
        raise FileError(
            f"line {self.line} has '{text.strip()[:80]}' in <{self.tag}>, where {wanted} numbers are needed; "
            "write the nominal numbers there",
            path=FILE,
        )


def parse(text: str) -> XmlElement:
    """The root of a file."""
    if "\ufffd" in text:
        raise FileError(
            "is not UTF-8, so the rest of it could not be preserved; convert it to UTF-8", path=FILE
        )
    data = text.encode()
    open_nodes: list[XmlElement] = []
    roots: list[XmlElement] = []
    parser = expat.ParserCreate("utf-8")

    def start(tag: str, attrib: dict[str, str]) -> None:
        at = parser.CurrentByteIndex
        found = START_TAG.match(data, at)
        assert found is not None
        parent = open_nodes[-1] if open_nodes else None
        node = XmlElement(data, tag, attrib, parser.CurrentLineNumber, at, found.end(), parent)
        (parent.children if parent else roots).append(node)
        open_nodes.append(node)

    def end(_tag: str) -> None:
        node = open_nodes.pop()
        node.ends.append(max(node.inside, parser.CurrentByteIndex) if node.is_open else node.inside)

    def refuse(*_: object) -> None:
        raise FileError("has a document type (<!DOCTYPE>), which is not read; remove it", path=FILE)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise FileError(f"is not XML: {error}", path=FILE) from None
    return roots[0]


def edited(text: str, edits: Iterable[Edit]) -> str:
    """The file with its edits, which don't overlap."""
    data = text.encode()
    for edit in sorted(edits, key=lambda e: (e.start, e.stop), reverse=True):
        data = data[: edit.start] + edit.new + data[edit.stop :]
    return data.decode()
