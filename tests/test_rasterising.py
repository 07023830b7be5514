"""Edges lie where Vulkan allows them to, or figures that the tests of shadow maps draw from it mean nothing."""

from rasterising import COARSEST, edge_error


def test_edges_are_drawn_where_they_are() -> None:
    assert 0 < edge_error() <= COARSEST
