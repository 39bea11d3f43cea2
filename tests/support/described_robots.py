"""Robots described by texts of URDF: bodies with diagonal tensors, bars, and a quadruped."""

from __future__ import annotations


def body(name: str, mass: float, centre: str, tensor: tuple[float, float, float]) -> str:
    ixx, iyy, izz = tensor
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial></link>'
    )


def bar(name: str, mass: float, length: float) -> str:
    """A uniform thin bar along x."""
    inertia = mass * length**2 / 12
    return body(name, mass, f"{length / 2} 0 0", (0.0, inertia, inertia))


def turning(name: str, parent: str, child: str, place: str, axis: str = "0 -1 0") -> str:
    """A joint whose positive angles lift a bar along x."""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-9" upper="9" velocity="9" effort="99"/></joint>'
    )


def described(*parts: str) -> str:
    """The text of a robot."""
    return f"<robot name='r'>{''.join(parts)}</robot>"


def quadruped() -> str:
    """A body of 20 kg with four legs of three joints, symmetrical to both vertical planes."""
    parts = [body("body", 20.0, "0 0 0", (0.5, 1.0, 1.2))]
    for name, x, y in (("lf", 0.3, 0.2), ("rf", 0.3, -0.2), ("lh", -0.3, 0.2), ("rh", -0.3, -0.2)):
        parts += [body(f"{name}_{link}", 1.0, "0 0 -0.1", (0.01, 0.01, 0.005)) for link in ("hip", "thigh", "shank")]
        ends = ((f"{x} {y} 0", "1 0 0"), (f"0 {y / 4} 0", "0 1 0"), ("0 0 -0.3", "0 1 0"))
        carriers = ("body", f"{name}_hip", f"{name}_thigh")
        for (place, axis), carrier, link in zip(ends, carriers, ("hip", "thigh", "shank"), strict=True):
            parts.append(turning(f"{name}_{link}", carrier, f"{name}_{link}", place, axis))
    return described(*parts)
