"""What is loaded together: payloads, and the instances and instancers that hide some."""

from collections.abc import Collection, Iterable, Iterator, Set
from dataclasses import dataclass

from pxr import Sdf, Usd, UsdGeom


@dataclass(frozen=True)
class LoadingUnit:
    """A prim that is read with its payloads, and unloaded again.

    Attributes:
        path: Path of the prim.
        payloads: What is loaded for it: itself, or what it shows copies of.
    """

    path: Sdf.Path
    payloads: frozenset[Sdf.Path]


def loading_units(stage: Usd.Stage, left_out: Collection[Sdf.Path] = ()) -> list[LoadingUnit]:
    """The units of a stage without payloads, sorted by path; none contains another.

    Payloads inside of a payload are loaded with it. Those inside of an instance are those of its
    prototype, and those of a point instancer's prototypes may lie anywhere.

    Args:
        stage: Stage without payloads.
        left_out: Prims that are no part of any unit, with all below.
    """
    apart, known = frozenset(left_out), {*_unloaded_payloads(stage), *_bare_instances(stage)}
    loadable = {
        path
        for path in known
        if not _is_in(path.GetParentPath(), known) and not _is_in(path, apart)
    }
    hidden: set[Sdf.Path] = set()
    units = []
    for prim in stage.Traverse():
        path = prim.GetPath()
        if not prim.IsA("PointInstancer") or _is_in(path, loadable) or _is_in(path, apart):
            continue
        needed = frozenset(_needed(UsdGeom.PointInstancer(prim), loadable))
        if needed:
            units.append(LoadingUnit(path, needed))
            hidden |= {each for each in needed if each.HasPrefix(path)}
    units += [LoadingUnit(path, frozenset((path,))) for path in loadable - hidden]
    return sorted(units, key=lambda unit: unit.path)


def _unloaded_payloads(stage: Usd.Stage) -> list[Sdf.Path]:
    """Paths of the prims whose payloads are not loaded, sorted."""
    return sorted({*stage.FindLoadable()} - {*stage.GetLoadSet()})


def _needed(instancer: UsdGeom.PointInstancer, loadable: Iterable[Sdf.Path]) -> Iterator[Sdf.Path]:
    """What has to be loaded for the prototypes of an instancer."""
    targets = instancer.GetPrototypesRel().GetTargets()
    for path in loadable:
        if any(path.HasPrefix(target) or target.HasPrefix(path) for target in targets):
            yield path


def _bare_instances(stage: Usd.Stage) -> set[Sdf.Path]:
    """Instances, outside of prototypes, whose prototype has payloads that are not loaded."""
    ahead = [prototype for prototype in stage.GetPrototypes() if _lacks_payloads(prototype)]
    seen = {prototype.GetPath() for prototype in ahead}
    found = set()
    while ahead:
        for instance in ahead.pop().GetInstances():
            if not instance.IsInPrototype():
                found.add(instance.GetPath())
                continue
            holder = stage.GetPrimAtPath(instance.GetPath().GetPrefixes()[0])
            if holder.GetPath() not in seen:
                seen.add(holder.GetPath())
                ahead.append(holder)
    return found


def _lacks_payloads(prototype: Usd.Prim) -> bool:
    inside = Usd.PrimRange(prototype, Usd.PrimIsActive & Usd.PrimIsDefined)
    return any(prim.HasAuthoredPayloads() and not prim.IsLoaded() for prim in inside)


def _is_in(path: Sdf.Path, others: Set[Sdf.Path]) -> bool:
    """True if a path is one of a set or lies below one."""
    return any(each in others for each in path.GetPrefixes())
