#include "{name}.h"
#ifdef __cplusplus
extern "C" {{
#endif
{real} of({real} v, {real} l, {real} t, {real} q) {{ return friction_torque_at(0, v, l, t, q); }}
{real} mean({real} v, {real} l, {real} t) {{ return friction_torque(0, v, l, t); }}
static friction_state state;
{real} compensation({real} v, {real} w) {{
    const friction_settings own = {{({real})0.8, ({real})0.05, ({real})0.02, ({real})0.01, ({real})0.02, ({real})1.0}};
    return friction_compensation(0, v, w, 0, 0, ({real})0.001, &own, &state);
}}
#ifdef __cplusplus
}}
#endif
