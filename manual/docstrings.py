"""Types in docstrings as they are written: `ndarray, shape (n, 3), float64 [m]` is no Python.

An extension of griffe, which reads the code for the pages of the Python reference; it would take
such a type for a tuple.
"""

from typing import Any

import griffe

_WITH_TYPES = {
    griffe.DocstringSectionKind.attributes,
    griffe.DocstringSectionKind.parameters,
    griffe.DocstringSectionKind.other_parameters,
    griffe.DocstringSectionKind.raises,
    griffe.DocstringSectionKind.returns,
    griffe.DocstringSectionKind.yields,
}


class WrittenTypes(griffe.Extension):
    """Keeps what stands behind the colon of each parameter, attribute, return value and error."""

    def on_package(self, *, pkg: griffe.Module, **kwargs: Any) -> None:
        """Look at every docstring of a package, once it is read."""
        del kwargs
        self._keep(pkg)

    def _keep(self, owner: griffe.Object) -> None:
        if (docstring := owner.docstring) is not None:
            # With the signature's defaults, and as it stands; both without complaints, for only
            # some of what is read is shown.
            read = docstring.parse(griffe.Parser.numpy, warnings=False)
            text = griffe.Docstring(docstring.value)
            for section, written in zip(
                read, text.parse(griffe.Parser.numpy, warnings=False), strict=False
            ):
                _keep_types(section, written)
            vars(docstring)["parsed"] = read
        for member in owner.members.values():
            if isinstance(member, griffe.Object):
                self._keep(member)


def _keep_types(section: griffe.DocstringSection, source: griffe.DocstringSection) -> None:
    if section.kind is source.kind and section.kind in _WITH_TYPES:
        for element, written in zip(section.value, source.value, strict=False):
            if isinstance(written.annotation, str) and written.annotation:
                element.annotation = written.annotation
