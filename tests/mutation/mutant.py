"""One small change of one source file."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """`text[start:end]` of `file` becomes `new`; `kind` names the operator."""

    file: str
    start: int
    end: int
    new: str
    kind: str

    def apply(self, text: str) -> str:
        return text[: self.start] + self.new + text[self.end :]

    def line(self, text: str) -> int:
        return text.count("\n", 0, self.start) + 1

    def change(self, text: str) -> tuple[str, str]:
        """Return the lines before and after, without indentation: the key of the change, whatever its line."""
        first, last = text.rfind("\n", 0, self.start) + 1, text.find("\n", self.end)
        last = len(text) if last < 0 else last
        old, new = text[first:last], text[first : self.start] + self.new + text[self.end : last]
        return " ".join(old.split()), " ".join(new.split())
