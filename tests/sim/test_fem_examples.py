"""The examples in the docstrings of the finite elements are true."""

import doctest

from fras_sim.fem import assembly
from fras_sim.fem.mesh import box_mesh


def test_a_stretched_block_stores_what_its_docstring_says():
    result = doctest.testmod(assembly, extraglobs={"box_mesh": box_mesh})
    assert result.attempted >= 6
    assert result.failed == 0
