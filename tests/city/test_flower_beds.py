"""Flower beds in front gardens."""

from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.models.environment_profile import GardenRules


def beds_of(make_map, by_place, chunks, country, share):
    """Beds with their plots and houses, in both chunks."""
    scene = make_map(country, "residential")
    profile = replace(scene.profile, gardens=GardenRules(share))
    found = []
    for chunk in chunks:
        plan = plan_city(chunk, scene.plots, by_place, scene.heights[chunk], profile, 0)
        city = build_city(plan, scene.landuse[chunk], profile, roads=False)
        houses = {house.id: house for house in city.of_kind("Building")}
        plots = {plot.id: plot for plot in scene.plots}
        for thing in city.of_kind("CityFurniture"):
            if thing.placement is not None and thing.placement.template == "flower_bed":
                name = thing.id.removeprefix("flower_bed_").rsplit("_", 1)[0]
                found.append((thing.placement, plots[name], houses[f"building_{name}"]))
    return found


def test_beds_lie_in_front_gardens_and_leave_the_way_to_the_door_free(make_map, by_place, chunks):
    found = beds_of(make_map, by_place, chunks, "2", 1.0)
    assert len(found) > 10
    for placement, plot, house in found:
        x, y, z = placement.position
        assert shapely.Polygon(plot.polygon).contains(shapely.Point(x, y))
        # The fixture's ground rises beside the road at y = 100.
        assert abs(z - max(abs(y - 100.0) - 6.0, 0.0) * 0.05) < 0.02
        # The front looks at the road.
        assert np.sin(placement.heading) * np.sign(100.0 - y) > 0.999
        walls = [s.polygons.points[:, :2] for s in house.surfaces if s.kind == "GroundSurface"]
        outline = shapely.MultiPoint(np.concatenate(walls)).convex_hull
        assert outline.distance(shapely.Point(x, y)) > 0.45
        for surface in house.surfaces:
            for opening in surface.openings:
                if opening.kind == "DoorSurface":
                    assert abs(opening.polygons.points[:, 0].mean() - x) > 1.2


def test_the_share_of_gardens_with_beds_is_that_of_the_environment(make_map, by_place, chunks):
    assert not beds_of(make_map, by_place, chunks, "2", 0.0)
    with_some = {plot.id for _, plot, _ in beds_of(make_map, by_place, chunks, "2", 0.5)}
    with_all = {plot.id for _, plot, _ in beds_of(make_map, by_place, chunks, "2", 1.0)}
    assert 0.2 < len(with_some) / len(with_all) < 0.8
