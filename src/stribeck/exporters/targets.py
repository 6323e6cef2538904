"""Targets of `stribeck export --to`, with their friction models and the functions that format their files."""

from stribeck.exporters import model_files, text_files
from stribeck.exporters.forms import gear, plain, stribeck, viscous
from stribeck.exporters.target import Target

SAME = plain(**{name: name for name in ("static", "coulomb", "viscous", "armature")})
"""Coulomb and viscous friction by their own names."""

TARGETS: dict[str, Target] = {
    "mjcf": Target(
        forms={
            "plain": plain(coulomb="frictionloss", viscous="damping", armature="armature"),
            "lugre": stribeck(  # for MuJoCo's dcmotor
                coulomb="tau_c",
                static="tau_s",
                stribeck_velocity="omega_s",
                viscous="damping",
                bristle_stiffness="sigma_0",
                bristle_damping="sigma_1",
                armature="armature",
            ),
        },
        suffix=".xml",
        text=model_files.mjcf_text,
        ranges=text_files.mujoco_ranges,
        models=("mjcf", "urdf"),
    ),
    "urdf": Target(
        forms={"plain": plain(coulomb="friction", viscous="damping")},
        suffix=".urdf",
        text=model_files.urdf_text,
        models=("urdf",),
    ),
    "drake": Target(
        forms={"viscous": viscous(viscous="damping", armature="rotor_inertia")},
        suffix=".urdf",
        text=model_files.drake_text,
        models=("urdf",),
    ),
    "c": Target(forms={"all": None}, suffix=".h", text=text_files.c_text),
    "python": Target(forms={"all": None}, suffix=".py", text=text_files.python_text),
    "yaml": Target(
        forms={"all": None, "plain": SAME},
        suffix=".yaml",
        text=text_files.yaml_text,
        any_unit=True,
        ranges=text_files.yaml_ranges,
    ),
    "table": Target(forms={"all": None}, suffix=".csv", text=text_files.table_text),
    "isaaclab": Target(
        forms={
            "plain": plain(
                static="friction", coulomb="dynamic_friction", viscous="viscous_friction", armature="armature"
            )
        },
        suffix=".py",
        text=text_files.isaaclab_text,
        ranges=text_files.isaaclab_ranges,
    ),
    "mjlab": Target(
        forms={"plain": plain(coulomb="frictionloss", viscous="viscous_damping", armature="armature")},
        suffix=".py",
        text=text_files.mjlab_text,
    ),
    "usd": Target(forms={"plain": SAME}, suffix=".py", text=text_files.usd_text),
    "bam": Target(
        forms={
            "m4": gear(
                coulomb="friction_base",
                viscous="friction_viscous",
                stribeck="friction_stribeck",
                stribeck_velocity="dtheta_stribeck",
                gear_load="load_friction_base",
                armature="armature",
            )
        },
        suffix=".json",
        text=text_files.bam_text,
    ),
    "pinocchio": Target(
        forms={"plain": plain(coulomb="friction", viscous="damping", armature="armature")},
        suffix=".py",
        text=text_files.pinocchio_text,
    ),
}
"""Targets by their name after `--to`."""
