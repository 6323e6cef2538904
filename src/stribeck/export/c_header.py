"""A C header with the friction of a robot's joints, and its compensation: C99, and C++ as it is."""

import re
from collections.abc import Iterable

from stribeck.errors import SettingsError
from stribeck.export.numbers import NAMES, numbers_of
from stribeck.export.target import Request, Target

FADED = 0.5
"""Share of a weak joint's friction that is compensated [1]: too much of it would drive the joint."""

HEAD = """
#ifndef {guard}
#define {guard}

#include <math.h>

/* Define FRICTION_FLOAT before this file is included to work with floats. */
#ifdef FRICTION_FLOAT
typedef float friction_real;
#define FRICTION_F(name) name##f
#else
typedef double friction_real;
#define FRICTION_F(name) name
#endif

{joints}

typedef struct {{
{fields}
    friction_real confidence; /* share that is compensated, by the joint's verdict */
    friction_real mean_temperature; /* of the log [deg C], 0 if none was logged */
}} friction_joint;

static const friction_joint FRICTION_JOINTS[FRICTION_JOINT_COUNT] = {{
{rows}
}};
"""

FUNCTIONS = """
/*
 * Friction torque of a joint [N m], of a prismatic one [N]; positive for positive velocity, offset included; the mean
 * over the positions of the log. velocity [rad/s], [m/s]; load: torque that the joint carries without friction [N m];
 * temperature: above mean_temperature [K].
 */
static inline friction_real friction_torque(int joint, friction_real velocity, friction_real load,
                                            friction_real temperature)
{
    const friction_joint *p = &FRICTION_JOINTS[joint];
    const friction_real speed = FRICTION_F(fabs)(velocity);
    const friction_real rise = FRICTION_F(tanh)(p->slope * velocity);
    const friction_real slow = speed / p->stribeck_velocity;
    const friction_real bell = FRICTION_F(exp)(-(p->exponent == 2 ? slow * slow : FRICTION_F(pow)(slow, p->exponent)));
    const friction_real level = p->coulomb * rise + p->coulomb_difference * FRICTION_F(fabs)(rise);
    const friction_real more = p->load * FRICTION_F(fabs)(load) + p->coulomb_per_kelvin * temperature;
    const friction_real viscous = p->viscous + p->viscous_per_kelvin * temperature;
    return level * (1 + p->stribeck_gain * bell) + more * rise + viscous * velocity + p->viscous_difference * speed
           + p->offset;
}

/* The same at a position [rad]; where the log has not been, the nearest position where it has counts. */
static inline friction_real friction_torque_at(int joint, friction_real velocity, friction_real load,
                                               friction_real temperature, friction_real position)
{
    const friction_joint *p = &FRICTION_JOINTS[joint];
    const friction_real angle = p->ripple_per_turn * position;
    const friction_real near = FRICTION_F(fmin)(FRICTION_F(fmax)(position, p->lowest), p->highest);
    const friction_real turned = p->coulomb_cosine * (FRICTION_F(cos)(near) - p->mean_cosine)
                                 + p->coulomb_sine * (FRICTION_F(sin)(near) - p->mean_sine);
    const friction_real ripple = p->ripple_cosine * FRICTION_F(cos)(angle) + p->ripple_sine * FRICTION_F(sin)(angle);
    return friction_torque(joint, velocity, load, temperature) + turned * FRICTION_F(tanh)(p->slope * velocity)
           + ripple;
}
"""

COMPENSATION = """
typedef struct {
    friction_real gain;      /* below one: what is left of the friction damps [1] */
    friction_real near;      /* measured speed below which the desired velocity counts instead [rad/s] */
    friction_real dead_zone; /* desired speed below which a joint at rest gets nothing [rad/s] */
    friction_real release;   /* the same of a moving joint, smaller [rad/s] */
    friction_real fade;      /* time in which it comes and goes [s] */
    friction_real limit;     /* largest torque [N m] */
} friction_settings;

typedef struct {
    int moving;          /* whether the desired velocity has left the dead zone */
    friction_real share; /* of the compensation that has come [1] */
} friction_state;

/*
 * Torque to add to a joint's command [N m], every `period` [s]; start with a state of zeros.
 * The offset is not compensated: it is the sensor's, or a spring's. At rest the measured velocity is noise, and its
 * sign would drive a limit cycle, so that the desired one counts there, with a dead zone and hysteresis.
 */
static inline friction_real friction_compensation(int joint, friction_real measured, friction_real desired,
                                                  friction_real load, friction_real temperature, friction_real period,
                                                  const friction_settings *settings, friction_state *state)
{
    const friction_joint *p = &FRICTION_JOINTS[joint];
    const friction_real speed = FRICTION_F(fabs)(desired);
    const friction_real ratio = measured / settings->near;
    const friction_real rest = FRICTION_F(exp)(-ratio * ratio);
    const friction_real velocity = rest * desired + (1 - rest) * measured;
    const friction_real step = period / (settings->fade + period);
    friction_real torque;
    state->moving = speed > (state->moving ? settings->release : settings->dead_zone);
    state->share += step * ((friction_real)state->moving - state->share);
    torque = settings->gain * p->confidence * state->share
             * (friction_torque(joint, velocity, load, temperature) - p->offset);
    return FRICTION_F(fmin)(FRICTION_F(fmax)(torque, -settings->limit), settings->limit);
}

#endif
"""


def c_text(request: Request) -> str:
    """Return the header."""
    joints = {name: request.result.joints[name] for name in request.joints}
    own = identifiers(joints)
    names = [f"    FRICTION_{own[name]} = {k}," for k, name in enumerate(joints)]
    rows = []
    for name, joint in joints.items():
        numbers = [
            *numbers_of(joint).values(),
            FADED if joint.verdict == "weak" else 1.0,
            joint.mean_temperature or 0.0,
        ]
        rows.append(f"    {{{', '.join(f'(friction_real){number!r}' for number in numbers)}}}, /* {own[name]} */")
    head = HEAD.format(
        guard=f"FRICTION_{identifier(request.result.robot)}_H",
        joints="\n".join(["enum {", *names, f"    FRICTION_JOINT_COUNT = {len(joints)}", "};"]),
        fields="\n".join(f"    friction_real {name};" for name in NAMES),
        rows="\n".join(rows),
    )
    lines = [re.sub(r"\*/|/\*", "", line).encode("ascii", "replace").decode() for line in request.lines]
    comment = "\n".join(["/*", *(f" * {' '.join(line.split())}" for line in lines), " */"])
    return comment.replace("??", "?") + head + FUNCTIONS + COMPENSATION


def identifier(name: str) -> str:
    """Return a name in capitals of which nothing but letters, digits and underscores of ASCII is left."""
    return re.sub(r"[^0-9A-Z]+", "_", name.upper()).strip("_") or "ROBOT"


def identifiers(names: Iterable[str]) -> dict[str, str]:
    """Return the identifier of each name.

    Raises
    ------
    SettingsError
        If two names have the same one.
    """
    found: dict[str, str] = {}
    for name in names:
        own = identifier(name)
        if own in found.values():
            other = next(each for each in found if found[each] == own)
            raise SettingsError(
                f"export: joints '{other}' and '{name}' have the same identifier {own}; rename one of them"
            )
        found[name] = own
    return found


TARGET = Target(title="a C99 header for a controller, valid C++ too", forms={"all": None}, suffix=".h", text=c_text)
