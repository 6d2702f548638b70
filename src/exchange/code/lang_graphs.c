/* SPDX-License-Identifier: BSD-3-Clause */
/* Python with a package that records the operations on its arguments, in order to differentiate, batch or compile them:
 * JAX in NAME_jax.py, CasADi in NAME_casadi.py, PyTorch in NAME_torch.py. Nothing is assigned to entries of an array:
 * entries are collected in a dictionary, of which the array is made at the end. Parameters are an argument, the last
 * one, since all derivatives by them are wanted. Both values of a choice are computed. */
#include "exchange/code/forward_in_python.h"
#include "exchange/code/language.h"

#define BLOCK(text) "\n\n" text "\n"

#define PIECE                                                                                                          \
    "def _piece(c, d, s):\n"                                                                                           \
    "    if d == 0:\n"                                                                                                 \
    "        return c[0] + s*(c[1] + s*(c[2] + s*c[3]))\n"                                                             \
    "    if d == 1:\n"                                                                                                 \
    "        return c[1] + s*(2*c[2] + s*(3*c[3]))\n"                                                                  \
    "    return 2*c[2] + s*(6*c[3]) if d == 2 else 6*c[3] if d == 3 else 0.0\n\n\n"                                    \
    "def _ends(table, d, at):\n"                                                                                       \
    "    \"\"\"The values before and after all points: straight lines.\"\"\"\n"                                        \
    "    x, y, c = table\n"                                                                                            \
    "    slopes = c[0][1], _piece(c[-1], 1, x[-1] - x[-2])\n"                                                          \
    "    if d > 0:\n"                                                                                                  \
    "        return slopes if d == 1 else (0.0, 0.0)\n"                                                                \
    "    return y[0] + slopes[0]*(at - x[0]), y[-1] + slopes[1]*(at - x[-1])"

/* Functions that all three libraries call by the same names. */
#define ALIKE(library)                                                                                                 \
    [KMP_OP_SIN] = {.call = library "sin"}, [KMP_OP_COS] = {.call = library "cos"},                                    \
    [KMP_OP_SQRT] = {.call = library "sqrt"}, [KMP_OP_EXP] = {.call = library "exp"},                                  \
    [KMP_OP_LOG] = {.call = library "log"}, [KMP_OP_SINH] = {.call = library "sinh"},                                  \
    [KMP_OP_COSH] = {.call = library "cosh"}, [KMP_OP_TANH] = {.call = library "tanh"},                                \
    [KMP_OP_SIGN] = {.call = library "sign"}, [KMP_OP_FLOOR] = {.call = library "floor"}

static const kmp_function_spelling in_jax[KMP_OP_COUNT] = {
    ALIKE("jnp."),
    [KMP_OP_ASIN] = {.call = "jnp.arcsin"},
    [KMP_OP_ACOS] = {.call = "jnp.arccos"},
    [KMP_OP_ATAN] = {.call = "jnp.arctan"},
    [KMP_OP_ABS] = {.call = "jnp.abs"},
    [KMP_OP_POW] = {.call = "jnp.power"},
    [KMP_OP_ATAN2] = {.call = "jnp.arctan2"},
    [KMP_OP_MIN] = {.call = "jnp.minimum"},
    [KMP_OP_MAX] = {.call = "jnp.maximum"},
    [KMP_OP_LESS] = {.call = "_less", .definition = BLOCK("def _less(x, y):\n    return jnp.where(x < y, 1.0, 0.0)")},
    [KMP_OP_SELECT] = {.call = "_select",
                       .definition = BLOCK("def _select(c, x, y):\n    return jnp.where(c != 0, x, y)")},
    [KMP_OP_TABLE] = {.definition =
                          BLOCK("def _table(table, d, at):\n"
                                "    x, y, c = (np.array(part) for part in table)\n"
                                "    k = jnp.clip(jnp.searchsorted(x, at, side=\"right\") - 1, 0, len(x) - 2)\n"
                                "    inside = _piece(jnp.asarray(c)[k], d, at - jnp.asarray(x)[k])\n"
                                "    low, high = _ends((x, y, c), d, at)\n"
                                "    value = jnp.where(at < x[0], low, jnp.where(at > x[-1], high, inside))\n"
                                "    return jnp.where(at != at, at, value)\n\n\n" PIECE)}};

static const kmp_function_spelling in_casadi[KMP_OP_COUNT] = {
    ALIKE("casadi."),
    [KMP_OP_ASIN] = {.call = "casadi.asin"},
    [KMP_OP_ACOS] = {.call = "casadi.acos"},
    [KMP_OP_ATAN] = {.call = "casadi.atan"},
    [KMP_OP_ABS] = {.call = "casadi.fabs"},
    [KMP_OP_POW] = {.call = "casadi.power"},
    [KMP_OP_ATAN2] = {.call = "casadi.atan2"},
    [KMP_OP_MIN] = {.call = "casadi.fmin"},
    [KMP_OP_MAX] = {.call = "casadi.fmax"},
    [KMP_OP_LESS] = {.call = "casadi.lt"},
    [KMP_OP_SELECT] = {.call = "_select",
                       .definition = BLOCK("def _select(c, x, y):\n    return casadi.if_else(casadi.ne(c, 0), x, y)")},
    [KMP_OP_TABLE] = {
        .definition = BLOCK("def _table(table, d, at):\n"
                            "    x, _, c = table\n"
                            "    inside = _choose(at, x[1:-1], [_piece(c[k], d, at - x[k]) for k in range(len(c))])\n"
                            "    low, high = _ends(table, d, at)\n"
                            "    return _either(at, x[0], low, casadi.if_else(x[-1] < at, high, inside))\n\n\n"
                            "def _either(at, x, below, above):\n"
                            "    return casadi.if_else(at < x, below, above)\n\n\n"
                            "def _choose(at, x, values):\n"
                            "    \"\"\"The value between two of the places x, by bisection.\"\"\"\n"
                            "    m = len(values)//2\n"
                            "    if m == 0:\n"
                            "        return values[0]\n"
                            "    return _either(at, x[m - 1], _choose(at, x[:m - 1], values[:m]), _choose(at, x[m:], "
                            "values[m:]))\n\n\n" PIECE)}};

static const kmp_function_spelling in_torch[KMP_OP_COUNT] = {
    ALIKE("torch."),
    [KMP_OP_ASIN] = {.call = "torch.asin"},
    [KMP_OP_ACOS] = {.call = "torch.acos"},
    [KMP_OP_ATAN] = {.call = "torch.atan"},
    [KMP_OP_ABS] = {.call = "torch.abs"},
    [KMP_OP_POW] = {.call = "torch.pow"},
    [KMP_OP_ATAN2] = {.call = "_atan2",
                      .definition = BLOCK("def _atan2(x, y):\n    return torch.atan2(_number(x), _number(y))")},
    [KMP_OP_MIN] = {.call = "_min",
                    .definition = BLOCK("def _min(x, y):\n    return torch.minimum(_number(x), _number(y))")},
    [KMP_OP_MAX] = {.call = "_max",
                    .definition = BLOCK("def _max(x, y):\n    return torch.maximum(_number(x), _number(y))")},
    [KMP_OP_LESS] = {.call = "_less",
                     .definition =
                         BLOCK("def _less(x, y):\n    return torch.where(_number(x) < y, _number(1.0), _number(0.0))")},
    [KMP_OP_SELECT] = {.call = "_select",
                       .definition = BLOCK(
                           "def _select(c, x, y):\n    return torch.where(_number(c) != 0, _number(x), _number(y))")},
    [KMP_OP_TABLE] = {
        .definition =
            BLOCK("def _table(table, d, at):\n"
                  "    at = _number(at)\n"
                  "    x, y, c = (torch.tensor(part, dtype=torch.float64, device=at.device) for part in table)\n"
                  "    k = (x[1:-1] <= at).sum().reshape(1)\n"
                  "    inside = _piece(torch.index_select(c, 0, k)[0], d, at - torch.index_select(x, 0, k)[0])\n"
                  "    low, high = (_number(end) for end in _ends((x, y, c), d, at))\n"
                  "    value = torch.where(at < x[0], low, torch.where(at > x[-1], high, _number(inside)))\n"
                  "    return torch.where(at != at, at, value)\n\n\n" PIECE)}};

/* -- files ------------------------------------------------------------------------------------------- */

#define FILE_OF(imports)                                                                                               \
    "$(banner)" imports "\n"                                                                                           \
    "model_hash = \"$(hash)\"\n"                                                                                       \
    "coordinate_names = $(coordinate names)\n"                                                                         \
    "row_names = $(row names)\n"                                                                                       \
    "$(if given)input_names = $(input names)\n$(end)"                                                                  \
    "$(if shown)output_names = $(output names)\n$(end)"                                                                \
    "$(if frictions)friction_names = $(friction names)\nfriction_rows = $(friction rows)\n"                            \
    "friction_modes = $(friction modes)\n$(end)"                                                                       \
    "$(if contacts)contact_names = $(contact names)\ncontact_rows = $(contact rows)\n"                                 \
    "contact_modes = $(contact modes)\n$(end)"                                                                         \
    "$(if elements)mode_entries = $(mode entries)\nelements = $(elements)\n$(end)"                                     \
    "$(if discrete)discrete_names = $(discrete names)\ndiscrete_places = $(discrete places)\n"                         \
    "sample_times = $(discrete times)\n$(end)"                                                                         \
    "$(if delays)delay_names = $(delay names)\ndelay_places = $(delay places)\ndelay_given = $(delay given)\n$(end)"   \
    "$(if prepared)parameter_names = $(parameter names)\n"                                                             \
    "parameter_values = $(values)\n$(end)"                                                                             \
    "$(each shared table)_table$(shared table) = ($(x), $(y), $(pieces))\n$(end)"                                      \
    "\n\n$(helpers)$(functions)"                                                                                       \
    "$(each routine)$(prepare)$(function)$(end)$(forward)"

#define SHARED                                                                                                         \
    .infinity = "math.inf", .nan = "math.nan", .quote = '"', .escape = '\\', .escaped = "\"\\",                        \
    .names = {"[", "]", ", ", ",\n    ", 8}, .numbers = {"[", "]", ", ", ",\n    ", 8},                                \
    .places = {"[", "]", ", ", ",\n    ", 20}, .pieces = {"[", "]", ",\n    ", NULL, 0},                               \
    .piece = {"(", ")", ", ", NULL, 0}, .open = '[', .close = ']', .chains = true, .takes_parameters = true,           \
    .local = "", .end = "", .comment = "#", .comment_end = "", .mark = "#", .routine_mark = "   ",                     \
    .table_call = "_table(_table$(shared table), $(derivative), ",                                                     \
    .prepare = "\n\ndef _$(routine)_prepare(p):\n$(each read input)    p = _list(p)\n$(end)"                           \
               "    k = {}\n$(statements)    return k\n",                                                              \
    .function = "\n\ndef $(routine)($(each input)$(if is argument)$(comma)$(argument)$(end)$(end)"                     \
                "$(if prepared), p=parameter_values$(end)):\n    \"\"\"Indices count from 0.\n\n$(about)    \"\"\"\n"  \
                "$(if prepared)    k = _$(routine)_prepare(p)\n$(end)"                                                 \
                "$(each read input)$(if is time)    t = _number(t)\n$(end)"                                            \
                "$(if is state)    $(argument) = _list($(argument))\n$(end)$(end)"                                     \
                "$(each array)    $(array) = {}\n$(end)$(statements)    return $(each array)$(comma)"                  \
                "$(if columns)_matrix($(array), $(height), $(columns))$(end)"                                          \
                "$(if not columns)_vector($(array), $(height))$(end)$(end)\n"

const kmp_language kmp_language_casadi = {.name = "casadi",
                                          .title = "Python for CasADi",
                                          SHARED,
                                          .functions = in_casadi,
                                          .helpers = KMP_RUNTIME_CASADI,
                                          .forward = kmp_put_forward,
                                          .pages = {{"$(name)_casadi.py", FILE_OF("import math\n\nimport casadi\n")}}};

const kmp_language kmp_language_jax = {
    .name = "jax",
    .title = "Python for JAX",
    SHARED,
    .functions = in_jax,
    .helpers = KMP_RUNTIME_JAX,
    .forward = kmp_put_forward,
    .pages = {{"$(name)_jax.py", FILE_OF("import math\n\nimport jax\nimport jax.numpy as jnp\nimport numpy as np\n")}}};

const kmp_language kmp_language_torch = {.name = "torch",
                                         .title = "Python for PyTorch",
                                         SHARED,
                                         .functions = in_torch,
                                         .helpers = KMP_RUNTIME_TORCH,
                                         .forward = kmp_put_forward,
                                         .pages = {{"$(name)_torch.py", FILE_OF("import math\n\nimport torch\n")}}};
