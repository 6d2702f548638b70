/* SPDX-License-Identifier: BSD-3-Clause */
/* Python with NumPy: NAME.py. The scalar form computes with Python's own numbers, which are faster than NumPy's; the
 * vectorised form with arrays by step index. If Python raises an exception for an operation without a result, the
 * generated code gives IEEE's infinity or NaN. A choice between two values may have such a result in the value that is
 * not chosen. The preparation of parameters is always scalar, and also accepts the functions of arrays. */
#include "exchange/code/block_parts.h"
#include "exchange/code/language.h"
#include "exchange/code/write.h"

#define BLOCK(text) "\n\n" text "\n\n\n"

static const kmp_function_spelling functions[KMP_OP_COUNT] = {
    [KMP_OP_DIV] = {"_div", "_div = _ieee(operator.truediv, np.true_divide)\n", "_div = np.true_divide\n"},
    [KMP_OP_SIN] = {"_sin", "_sin = _ieee(math.sin, np.sin)\n", "_sin = np.sin\n"},
    [KMP_OP_COS] = {"_cos", "_cos = _ieee(math.cos, np.cos)\n", "_cos = np.cos\n"},
    [KMP_OP_SQRT] = {"_sqrt", "_sqrt = _ieee(math.sqrt, np.sqrt)\n", "_sqrt = np.sqrt\n"},
    [KMP_OP_EXP] = {"_exp", "_exp = _ieee(math.exp, np.exp)\n", "_exp = np.exp\n"},
    [KMP_OP_LOG] = {"_log", "_log = _ieee(math.log, np.log)\n", "_log = np.log\n"},
    [KMP_OP_SINH] = {"_sinh", "_sinh = _ieee(math.sinh, np.sinh)\n", "_sinh = np.sinh\n"},
    [KMP_OP_COSH] = {"_cosh", "_cosh = _ieee(math.cosh, np.cosh)\n", "_cosh = np.cosh\n"},
    [KMP_OP_TANH] = {"_tanh", "_tanh = math.tanh\n", "_tanh = np.tanh\n"},
    [KMP_OP_ASIN] = {"_asin", "_asin = _ieee(math.asin, np.arcsin)\n", "_asin = np.arcsin\n"},
    [KMP_OP_ACOS] = {"_acos", "_acos = _ieee(math.acos, np.arccos)\n", "_acos = np.arccos\n"},
    [KMP_OP_ATAN] = {"_atan", "_atan = math.atan\n", "_atan = np.arctan\n"},
    [KMP_OP_ABS] = {"_abs", "_abs = abs\n", "_abs = np.abs\n"},
    [KMP_OP_SIGN] = {"_sign", BLOCK("def _sign(x):\n    return x if x != x else float((x > 0) - (x < 0))"),
                     "_sign = np.sign\n"},
    [KMP_OP_FLOOR] = {"_floor", "_floor = _ieee(lambda x: float(math.floor(x)), np.floor)\n", "_floor = np.floor\n"},
    [KMP_OP_POW] = {"_pow", "_pow = _ieee(math.pow, np.power)\n", "_pow = np.power\n"},
    [KMP_OP_ATAN2] = {"_atan2", "_atan2 = math.atan2\n", "_atan2 = np.arctan2\n"},
    [KMP_OP_MIN] = {"_min", BLOCK("def _min(x, y):\n    return x if x < y or x != x else y"), "_min = np.minimum\n"},
    [KMP_OP_MAX] = {"_max", BLOCK("def _max(x, y):\n    return x if x > y or x != x else y"), "_max = np.maximum\n"},
    [KMP_OP_LESS] = {"_less", BLOCK("def _less(x, y):\n    return 1.0 if x < y else 0.0"),
                     BLOCK("def _less(x, y):\n    return np.where(x < y, 1.0, 0.0)")},
    [KMP_OP_SELECT] = {"_select", BLOCK("def _select(c, x, y):\n    return x if c != 0 else y"),
                       BLOCK("def _select(c, x, y):\n    return np.where(c != 0, x, y)")},
    [KMP_OP_TABLE] = {.definition =
                          BLOCK("def _table(table, d, at):\n"
                                "    x, y, c = table\n"
                                "    last = len(x) - 2\n"
                                "    if at != at:\n"
                                "        return at\n"
                                "    if at < x[0]:\n"
                                "        return y[0] + c[0][1]*(at - x[0]) if d == 0 else c[0][1] if d == 1 else 0.0\n"
                                "    if at > x[-1]:\n"
                                "        slope = _piece(c[last], 1, x[-1] - x[last])\n"
                                "        return y[-1] + slope*(at - x[-1]) if d == 0 else slope if d == 1 else 0.0\n"
                                "    k = min(bisect.bisect_right(x, at) - 1, last)\n"
                                "    return _piece(c[k], d, at - x[k])\n\n\n"
                                "def _piece(c, d, s):\n"
                                "    if d == 0:\n"
                                "        return c[0] + s*(c[1] + s*(c[2] + s*c[3]))\n"
                                "    if d == 1:\n"
                                "        return c[1] + s*(2*c[2] + s*(3*c[3]))\n"
                                "    return 2*c[2] + s*(6*c[3]) if d == 2 else 6*c[3] if d == 3 else 0.0")},
    [KMP_OP_IMPLICIT] = {.definition = "$(newton)"}};

/* -- implicit blocks ----------------------------------------------------------------------------------- */

/* "rows=_M_C_block0_scan_rows, ": values by place of a part. */
static void put_rows(const kmp_code_writer *w, const struct kmp_code_block *b, kmp_block_part part, const char *name)
{
    const kmp_place_values *rows = &b->rows[part];
    const kmp_list_spelling *list = &w->language->numbers;
    if (rows->width == 0)
        return;
    kmp_text_printf(w->text, "\n\n%s_%s_rows = [", name, kmp_block_part_names[part]);
    for (int k = 0; k < b->block->candidates; k++) {
        kmp_text_put(w->text, k > 0 ? ",\n    " : "");
        kmp_put_numbers(w->text, w->language, list, rows->width, rows->rows + (ptrdiff_t)k * rows->width);
    }
    kmp_text_put(w->text, "]\n");
}

static void put_block(const kmp_code_writer *w, const struct kmp_code_block *b, int number)
{
    const bool averages = b->block->averages;
    kmp_text name = {0};
    kmp_text_printf(&name, "_%s_block%d", w->routine->name, number);
    for (int k = 0; name.s && k < KMP_BLOCK_PARTS; k++)
        put_rows(w, b, (kmp_block_part)k, name.s);
    kmp_text_printf(w->text, "\n\ndef %s(p):\n", name.s ? name.s : "");
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program)
            kmp_text_printf(w->text, "    %s = %s_%s_prepare(p)\n", kmp_block_part_names[k], name.s ? name.s : "",
                            kmp_block_part_names[k]);
    kmp_text_printf(w->text, "    return %s(%d", averages ? "_average" : "_solve", b->block->unknowns);
    if (averages)
        kmp_text_printf(w->text, ", %s_guess_rows, %s_equations_rows", name.s ? name.s : "", name.s ? name.s : "");
    else if (b->rows[KMP_PART_SCAN].width > 0)
        kmp_text_printf(w->text, ", %s_scan_rows", name.s ? name.s : "");
    else
        kmp_text_put(w->text, ", None");
    for (int k = 0; name.s && k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program) /* with its numbers of these arguments, ", lambda q: _M_C_block0_scan(scan, q)" */
            kmp_text_printf(w->text, ", lambda q: %s_%s(%s, q)", name.s, kmp_block_part_names[k],
                            kmp_block_part_names[k]);
        else if (!averages)
            kmp_text_put(w->text, ", None");
    kmp_text_put(w->text, ")\n");
    kmp_text_free_part(w->text, &name);
}

/* -- files ------------------------------------------------------------------------------------------- */

static const char file[] =
    "$(banner)import bisect\nimport math\nimport operator\n\nimport numpy as np\n\n"
    "model_hash = \"$(hash)\"\n"
    "coordinate_names = $(coordinate names)\n"
    "row_names = $(row names)\n"
    "$(if given)input_names = $(input names)\n$(end)"
    "$(if shown)output_names = $(output names)\n$(end)"
    "$(if frictions)friction_names = $(friction names)\nfriction_rows = $(friction rows)\n"
    "friction_modes = $(friction modes)\n$(end)"
    "$(if contacts)contact_names = $(contact names)\ncontact_rows = $(contact rows)\n"
    "contact_modes = $(contact modes)\n$(end)"
    "$(if elements)mode_entries = $(mode entries)\nelements = $(elements)\n$(end)"
    "$(if discrete)discrete_names = $(discrete names)\ndiscrete_places = $(discrete places)\n"
    "sample_times = $(discrete times)\n$(end)"
    "$(if delays)delay_names = $(delay names)\ndelay_places = $(delay places)\ndelay_given = $(delay given)\n$(end)"
    "$(if prepared)parameter_names = $(parameter names)\n"
    "parameter_values = $(values)\n$(end)"
    "$(each shared table)_table$(shared table) = ($(x), $(y), $(pieces))\n$(end)"
    "\n\ndef _ieee(function, other):\n"
    "    def call(*x):\n"
    "        try:\n"
    "            return function(*x)\n"
    "        except (ArithmeticError, ValueError):\n"
    "            with np.errstate(all='ignore'):\n"
    "                return float(other(*x))\n"
    "    return call\n\n\n"
    "$(functions)\n"
    "$(each routine)$(blocks)$(prepare)$(function)$(end)";

#define ZEROS                                                                                                          \
    "$(each array)    $(array) = np.zeros($(if columns)($(height), $(columns))$(end)$(if not columns)$(height)$(end))" \
    "\n$(end)"
#define HEAD                                                                                                           \
    "\n\ndef $(routine)($(each input)$(comma)$(argument)$(end)):\n    \"\"\"Indices count from 0.\n\n$(about)    "     \
    "\"\"\"\n"

const kmp_language kmp_language_python = {
    .name = "python",
    .title = "Python",
    .infinity = "math.inf",
    .nan = "math.nan",
    .quote = '"',
    .escape = '\\',
    .escaped = "\"\\",
    .names = {"[", "]", ", ", ",\n    ", 8},
    .numbers = {"[", "]", ", ", ",\n    ", 8},
    .places = {"[", "]", ", ", ",\n    ", 20},
    .pieces = {"[", "]", ",\n    ", NULL, 0},
    .piece = {"(", ")", ", ", NULL, 0},
    .open = '[',
    .close = ']',
    .chains = true,
    .divides_by_call = true,
    .local = "",
    .end = "",
    .comment = "#",
    .comment_end = "",
    .mark = "#",
    .routine_mark = "   ",
    .table_call = "_table(_table$(shared table), $(derivative), ",
    .functions = functions,
    .prepare = "\n\ndef $(routine)_prepare(p=parameter_values):\n"
               "    \"\"\"k from the parameters: once, whenever they have changed.\"\"\"\n"
               "    k = [0.0]*$(kept)\n$(statements)    return k\n",
    .function = HEAD "$(each read input)$(if is state)    $(argument) = np.asarray($(argument), "
                     "dtype=float).tolist()\n$(end)$(end)" ZEROS
                     "$(statements)    return $(each array)$(comma)$(array)$(end)\n",
    .inner_prepare = "\n\ndef _$(routine)_prepare(p):\n    k = [0.0]*$(kept)\n$(statements)    return k\n",
    .inner_function = "\n\ndef _$(routine)(k, q):\n$(each array)    $(array) = [0.0]*$(height)\n$(end)"
                      "$(statements)    return $(each array)$(array)$(end)\n",
    .block = put_block,
    .solve = "    $(what) = _$(routine)_block$(number)([$(argument)])\n",
    .newton = KMP_RUNTIME_NEWTON_PYTHON,
    .arrays = {.function = "\n\n# $(routine): $(size) values in $(steps) steps, $(group count) statements\n"
                           "_$(routine)_v = np.zeros($(size))\n"
                           "_$(routine)_v[:$(constant count)] = $(constants)\n"
                           "$(lists)" HEAD "    v = _$(routine)_v.copy()\n    take = v.take\n"
                           "$(each input)$(if width)    v[$(first):$(last)] = $(argument)\n$(end)$(end)"
                           "$(if group count)    with np.errstate(all='ignore'):\n$(end)$(groups)" ZEROS
                           "$(scatter)    return $(each array)$(comma)$(array)$(end)\n",
               .table = "[_table(_table$(shared table), $(derivative), x) for x in $(operands)]",
               .range = "        v[$(first):$(last)] = ",
               .gather = "take(_$(routine)_$(what)$(number))",
               .signs = "_$(routine)_$(what)$(number)*",
               .plus = "1.0",
               .minus = "-1.0",
               .scatter = "    $(array).flat[_$(routine)_$(what)$(number)] = ",
               .define = "_$(routine)_$(what)$(number) = np.array($(places), dtype=np.intp)\n",
               .define_signs = "_$(routine)_$(what)$(number) = np.array($(signs))\n",
               .times = "*"},
    .pages = {{"$(name).py", file}}};
