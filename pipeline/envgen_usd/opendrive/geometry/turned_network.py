"""Rotates a network around the origin by the heading of the header's offset (8.5)."""

import math
from dataclasses import replace

import numpy as np

from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.signals import Signal


def turned(network: RoadNetwork, angle: float) -> RoadNetwork:
    """Rotates all inertial coordinates, so that only a translation remains.

    Args:
        network: The network; its `offset` stays as in the file.
        angle: Radians, anticlockwise around the origin.
    """
    if not angle:
        return network
    roads = {id_: _road(road, angle) for id_, road in network.roads.items()}
    junctions = {
        id_: replace(each, plan_view=_plan_view(each.plan_view, angle) if each.plan_view else None)
        for id_, each in network.junctions.items()
    }
    return replace(network, roads=roads, junctions=junctions)


def _road(road: Road, angle: float) -> Road:
    signals = tuple(_signal(signal, angle) for signal in road.signals)
    return replace(road, plan_view=_plan_view(road.plan_view, angle), signals=signals)


def _plan_view(view: PlanView, angle: float) -> PlanView:
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = view.x * cosine - view.y * sine, view.x * sine + view.y * cosine
    return replace(view, x=x, y=y, heading=view.heading + angle)


def _signal(signal: Signal, angle: float) -> Signal:
    """Rotates a positionInertial; all other coordinates are relative to the road."""
    if signal.position is None:
        return signal
    x, y, z = signal.position
    cosine, sine = math.cos(angle), math.sin(angle)
    place = x * cosine - y * sine, x * sine + y * cosine, z
    return replace(signal, position=place, heading=signal.heading + angle)
