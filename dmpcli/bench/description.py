"""An arm by a description file that MuJoCo reads, MJCF or URDF: ``bench://ARM?model=FILE``.

What the file says of the links' masses and rotors and of the joints' ranges is taken, in the frames
of the kinematic model that the controller goes by; so both agree whatever the file has rounded.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli import extras
from dmpcli.arrays import Floats
from dmpcli.bench.links import Links, turning_frames
from dmpcli.errors import InputError
from dmpcli.kinematics import chain
from dmpcli.kinematics.matching import LENGTHS, Matched, matched
from dmpcli.kinematics.models import Arm, model
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import log_one

MENAGERIE = "menagerie"
"""In place of a file: the arm of DeepMind's MuJoCo Menagerie."""

_IN_MENAGERIE = {"ur5e": "universal_robots_ur5e"}

# By how much a length may depart from the maker's table, mm: corrections of a single arm and
# rounded tables stay below, another arm of the family does not.
_CORRECTED = 2.0
# What is left then is rounding: a description writes 90 degrees as 1.5708, mm and rad.
_ROUNDED = (0.05, 1e-4)
_POSTURES = 50
_SUFFIXES = (".xml", ".urdf")
_LIGHTEST = 1e-3  # kg
# What a file may hold beside bodies, joints and frames; none of it is of use here.
_BESIDE = (
    "sensors", "keys", "actuators", "tendons", "equalities", "pairs", "excludes", "skins", "flexes",
    "cameras", "lights", "numerics", "texts", "tuples",
)  # fmt: skip


def read(said: str, name: str) -> Links:
    """Read an arm from its description.

    Parameters
    ----------
    said : str
        A path, or `MENAGERIE`.
    name : str
        Of the arm whose kinematics it must have.

    Raises
    ------
    InputError
        MuJoCo, or for `MENAGERIE` mujoco-menagerie, is not installed; the file cannot be read, is
        no description, no arm of six hinges one upon another, or one of other kinematics.
    """
    (mujoco,) = extras.load(extras.BENCH, f"bench: model={said}", "mujoco")
    path = _fetched(name) if said == MENAGERIE else Path(said)
    return _Description(path, mujoco).links(model(name))


def _fetched(name: str) -> Path:
    """The Menagerie's file, which its package fetches at first use."""
    if name not in _IN_MENAGERIE:
        raise InputError(
            f"bench://{name}: model={MENAGERIE}: the MuJoCo Menagerie has no {name}, but "
            f"{', '.join(_IN_MENAGERIE)}; name a file: model=FILE"
        )
    (menagerie,) = extras.load(extras.MENAGERIE, f"bench: model={MENAGERIE}", "mujoco_menagerie")
    try:
        found = menagerie.get(_IN_MENAGERIE[name])
        return Path(found.xml(found.default_model))
    except (menagerie.MenagerieError, OSError) as error:
        raise InputError(
            f"bench: model={MENAGERIE}: {_IN_MENAGERIE[name]} cannot be fetched: {_line(error)}; "
            "MENAGERIE_ROOT may name a checkout, or model= a file"
        ) from None


class _Description:
    """A file as MuJoCo compiles it.

    Parameters
    ----------
    path : Path
    mujoco : module
    """

    def __init__(self, path: Path, mujoco: Any) -> None:
        self._path, self._mujoco = path, mujoco
        if not path.is_file():
            raise self._wrong("there is no such file")
        if path.suffix.lower() not in _SUFFIXES:
            raise self._wrong(f"is neither MJCF nor URDF; it ends with {' or '.join(_SUFFIXES)}")
        try:
            spec = mujoco.MjSpec.from_file(str(path))
            _strip(spec, mujoco)
            self._model = spec.compile()
        except (ValueError, UnicodeError, OSError, mujoco.FatalError) as error:
            raise self._wrong(f"MuJoCo cannot read it: {_line(error)}") from None
        self._data = mujoco.MjData(self._model)
        self._check_chain()
        self._pose_at(np.zeros(6))

    def links(self, arm: Arm) -> Links:
        """What it says of an arm.

        Raises
        ------
        InputError
            It has other kinematics, or a link without a mass.
        """
        base, told = self._laid_on(arm)
        arm = replace(base.arm, limits=self._ranges(base.arm))
        mass, centre, inertia = self._masses(arm, base.base)
        rotors: Floats = np.array(self._model.dof_armature)
        return Links(arm, mass, centre, inertia, rotors if rotors.any() else None, told)

    def _check_chain(self) -> None:
        found, hinge = self._model, self._mujoco.mjtJoint.mjJNT_HINGE
        hinges = int(np.sum(found.jnt_type == hinge))
        if found.njnt != 6 or hinges != 6:
            beside = f" and {found.njnt - hinges} other joints" if found.njnt > hinges else ""
            raise self._wrong(
                f"has {hinges} hinge joints{beside}, where the bench's arm has six; take the file "
                "of the arm alone"
            )
        for before, body in zip(found.jnt_bodyid[:-1], found.jnt_bodyid[1:], strict=True):
            if found.body_weldid[found.body_parentid[body]] != found.body_weldid[before]:
                raise self._wrong("its six hinges do not hang one upon another, each on a body")

    def _pose_at(self, joints: Floats) -> None:
        self._data.qpos[:] = joints
        self._mujoco.mj_kinematics(self._model, self._data)

    def _end(self) -> Pose:
        """Frame of the last link, mm."""
        last = self._model.jnt_bodyid[5]
        rotation = self._data.xmat[last].reshape(3, 3)
        return Pose(1e3 * self._data.xpos[last], rotation.copy())

    def _laid_on(self, arm: Arm) -> tuple[Matched, str]:
        """Lay the arm on the file: as published, else with the file's own lengths."""
        axis, point = self._data.xaxis.copy(), 1e3 * self._data.xanchor
        lain = matched(arm, axis, point, free=False)
        if _within(first := self._off(lain)):
            return lain, ""
        own = matched(arm, axis, point, free=True)
        changed = [
            f"{key}{i + 1} {new:g} instead of {old:g}"
            for key, i in LENGTHS
            if (new := getattr(own.arm, key)[i]) != (old := getattr(arm, key)[i])
        ]
        furthest = max(abs(getattr(own.arm, key)[i] - getattr(arm, key)[i]) for key, i in LENGTHS)
        if not _within(self._off(own)) or furthest > _CORRECTED:
            mm, angle = first
            raise self._wrong(
                f"its kinematics are not those of {arm.name}: the flange is off by up to "
                f"{mm:.3g} mm and {angle:.2g} rad with base and flange laid on each other"
            )
        return own, f"{', '.join(changed)} mm, by {self._path}"

    def _off(self, lain: Matched) -> tuple[float, float]:
        """By how much the ends of both chains differ in the worst of some postures, mm and rad."""
        arm, base, worst = lain.arm, lain.base, (0.0, 0.0)
        self._pose_at(np.zeros(6))
        flange = (base @ chain.forward_one(arm, np.zeros(6))).inverse() @ self._end()
        for joints in np.random.default_rng(0).uniform(-np.pi, np.pi, (_POSTURES, 6)):
            self._pose_at(joints)
            there, here = self._end(), base @ chain.forward_one(arm, joints) @ flange
            mm = float(np.linalg.norm(there.position - here.position))
            turned = float(np.linalg.norm(log_one(here.rotation.T @ there.rotation)))
            worst = max(worst[0], mm), max(worst[1], turned)
        self._pose_at(np.zeros(6))
        return worst

    def _ranges(self, arm: Arm) -> Floats:
        """Ranges of the joints, shape (6, 2), rad; the arm's own where the file has none."""
        limited = self._model.jnt_limited.astype(bool)
        return np.where(limited[:, None], self._model.jnt_range, arm.limits)

    def _masses(self, arm: Arm, base: Pose) -> tuple[Floats, Floats, Floats]:
        """Add up what hangs on each joint, in the frame that turns with it."""
        found, data = self._model, self._data
        frames = turning_frames(arm)
        position, rotation = frames.position, frames.rotation
        mass, centre, inertia = np.zeros(6), np.zeros((6, 3)), np.zeros((6, 3, 3))
        for i, body in enumerate(found.jnt_bodyid):
            parts = np.flatnonzero(found.body_weldid == body)
            m = found.body_mass[parts]
            mass[i] = m.sum()
            if mass[i] < _LIGHTEST:
                raise self._wrong(f"the link of joint {i + 1} weighs nothing")
            middle = m @ data.xipos[parts] / mass[i]
            about = np.zeros((3, 3))
            for one, k in zip(m, parts, strict=True):
                axes, off = data.ximat[k].reshape(3, 3), data.xipos[k] - middle
                about += (axes * found.body_inertia[k]) @ axes.T
                about += one * ((off @ off) * np.eye(3) - np.outer(off, off))
            frame = base @ Pose(position[i], rotation[i])
            centre[i] = frame.apply_inverse(1e3 * middle[None])[0] / 1e3
            inertia[i] = frame.rotation.T @ about @ frame.rotation
        return mass, centre, inertia

    def _wrong(self, why: str) -> InputError:
        return InputError(f"bench: model={self._path}: {why}")


def _strip(spec: Any, mujoco: Any) -> None:
    """Leave bodies and joints alone; geoms only where they are what a body weighs."""
    for kind in _BESIDE:
        for one in list(getattr(spec, kind)):
            spec.delete(one)
    weighs = mujoco.mjtInertiaFromGeom
    asked = spec.compiler.inertiafromgeom
    for geom in list(spec.geoms):
        body = geom.parent
        stated = asked == weighs.mjINERTIAFROMGEOM_FALSE or (
            body.explicitinertial and asked != weighs.mjINERTIAFROMGEOM_TRUE
        )
        if stated or not _moves(body):
            spec.delete(geom)
        else:
            geom.material = ""
    kept = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in kept:
            spec.delete(mesh)
    for kind in ("materials", "textures"):
        for one in list(getattr(spec, kind)):
            spec.delete(one)


def _moves(body: Any) -> bool:
    """Whether a joint lies between a body and the world."""
    while body is not None:
        if body.joints:
            return True
        body = body.parent
    return False


def _within(off: tuple[float, float]) -> bool:
    return off[0] <= _ROUNDED[0] and off[1] <= _ROUNDED[1]


def _line(error: Exception) -> str:
    """What an error says, in one line."""
    return " ".join(str(error).split()) or type(error).__name__
