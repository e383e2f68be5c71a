import numpy as np


def cubic(tag, **values):
    given = {"s": 0, "a": 0, "b": 0, "c": 0, "d": 0} | values
    return f"<{tag} " + " ".join(f'{name}="{value}"' for name, value in given.items()) + "/>"


def test_shapes_are_grouped_by_s_and_sorted_by_t(network_of, road_xml):
    """Trap 10: a profile in (s, t)."""
    lateral = (
        cubic("superelevation", a=0.1)
        + cubic("shape", s=50, t=0, a=2)
        + cubic("shape", s=0, t=1, a=5)
        + cubic("shape", s=0, t=-4, a=1, b=1)
    )
    road = network_of(road_xml(lateral=lateral)).roads["1"]
    assert road.shapes.s.tolist() == [0, 50]
    assert road.shapes.profiles[0](np.array([-4.0, -2.0, 1.0])).tolist() == [1, 3, 5]
    assert road.superelevation(np.array([3.0]))[0] == 0.1


def test_cross_section_surfaces(network_of, road_xml):
    lateral = """<crossSectionSurface><tOffset><coefficients s="0" a="0.5"/></tOffset>
      <surfaceStrips>
        <strip id="-1"><linear><coefficients s="0" a="0.15"/></linear></strip>
        <strip id="2" mode="independent">
          <constant><coefficients s="0" a="1" b="2"/></constant></strip>
        <strip id="1"><width><coefficients s="0" a="4"/></width></strip>
      </surfaceStrips></crossSectionSurface>"""
    surface = network_of(road_xml(lateral=lateral)).roads["1"].cross_section
    assert [strip.id for strip in surface.strips] == [1, 2, -1]
    assert surface.t_offset(np.array([7.0]))[0] == 0.5
    assert surface.strips[1].mode == "independent"
    assert surface.strips[1].constant(np.array([3.0]))[0] == 7
    assert surface.strips[2].linear(np.array([3.0]))[0] == 0.15


def test_a_piece_that_is_not_finite_is_left_out(network_of, road_xml, kinds):
    """Trap 2: nan in an elevation costs that piece and not the road."""
    elevation = (
        cubic("elevation", a=3) + cubic("elevation", s=10, a="nan") + cubic("elevation", s=20, a=3)
    )
    network = network_of(road_xml(elevation=elevation))
    assert network.roads["1"].elevation.start.tolist() == [0, 20]
    assert kinds(network) == ["number.not_finite"]


def test_steps_are_reported(network_of, road_xml, kinds):
    elevation = (
        cubic("elevation", b=0.1)
        + cubic("elevation", s=10, a=1.5)
        + cubic("elevation", s=20, a=1.5)
    )
    assert kinds(network_of(road_xml(elevation=elevation))) == ["elevation.step"]
