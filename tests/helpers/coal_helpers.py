"""Distances by pinocchio and coal, the oracle of the compiled core."""

import coal
import numpy as np
import pinocchio as pin

MAKE = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}


def by_coal(model, obstacles, pairs):
    """Return what lets pinocchio and coal measure the pairs, (P,), at a configuration."""
    geometry, index = pin.GeometryModel(), {}
    floor = pin.GeometryObject("floor", 0, pin.SE3.Identity(), coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0))
    index["floor"] = geometry.addGeometryObject(floor)
    placed = [(thing.name, thing.shape, *model.mount(thing)) for thing in model.description.collision]
    placed += [(o.name, o.shape, 0, pin.SE3(np.array(o.rotation), o.position)) for o in obstacles]
    for name, shape, joint, placement in placed:
        core = MAKE[shape.kind](*shape.size)
        index[name] = geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, core))
    for first, second in pairs:
        geometry.addCollisionPair(pin.CollisionPair(index[first], index[second]))
    data, found = model.pinocchio.createData(), pin.GeometryData(geometry)

    def measure(q):
        pin.computeDistances(model.pinocchio, data, geometry, found, q)
        return np.array([result.min_distance for result in found.distanceResults])

    return measure
