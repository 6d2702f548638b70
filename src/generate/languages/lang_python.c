/* SPDX-License-Identifier: BSD-3-Clause */
/* Python with NumPy: NAME.py. The scalar form computes with Python's own numbers, which are faster than NumPy's; the
 * vectorised form with arrays by step index. Where Python raises an exception for an operation without a result, the
 * generated code gives IEEE's infinity or NaN. A choice between two values may have such a result in the value that is
 * not chosen. */
#include "generate/banner.h"
#include "generate/languages/levels.h"
#include "generate/scalar.h"
#include "symbolic/table.h"
#include <string.h>

/* -- functions --------------------------------------------------------------------------------------- */

/* By operation: its text with numbers and with arrays. A function is called by `_` and its name. */
static const struct {
    const char *scalar, *vector;
} functions[KMP_OP_COUNT] = {
    [KMP_OP_ADD] = {"", ""},
    [KMP_OP_MUL] = {"", ""},
    [KMP_OP_DIV] = {"_div = _ieee(operator.truediv, np.true_divide)", "_div = np.true_divide"},
    [KMP_OP_SIN] = {"_sin = _ieee(math.sin, np.sin)", "_sin = np.sin"},
    [KMP_OP_COS] = {"_cos = _ieee(math.cos, np.cos)", "_cos = np.cos"},
    [KMP_OP_SQRT] = {"_sqrt = _ieee(math.sqrt, np.sqrt)", "_sqrt = np.sqrt"},
    [KMP_OP_EXP] = {"_exp = _ieee(math.exp, np.exp)", "_exp = np.exp"},
    [KMP_OP_LOG] = {"_log = _ieee(math.log, np.log)", "_log = np.log"},
    [KMP_OP_SINH] = {"_sinh = _ieee(math.sinh, np.sinh)", "_sinh = np.sinh"},
    [KMP_OP_COSH] = {"_cosh = _ieee(math.cosh, np.cosh)", "_cosh = np.cosh"},
    [KMP_OP_TANH] = {"_tanh = math.tanh", "_tanh = np.tanh"},
    [KMP_OP_ASIN] = {"_asin = _ieee(math.asin, np.arcsin)", "_asin = np.arcsin"},
    [KMP_OP_ACOS] = {"_acos = _ieee(math.acos, np.arccos)", "_acos = np.arccos"},
    [KMP_OP_ATAN] = {"_atan = math.atan", "_atan = np.arctan"},
    [KMP_OP_ABS] = {"_abs = abs", "_abs = np.abs"},
    [KMP_OP_SIGN] = {"def _sign(x):\n    return x if x != x else float((x > 0) - (x < 0))", "_sign = np.sign"},
    [KMP_OP_POW] = {"_pow = _ieee(math.pow, np.power)", "_pow = np.power"},
    [KMP_OP_ATAN2] = {"_atan2 = math.atan2", "_atan2 = np.arctan2"},
    [KMP_OP_MIN] = {"def _min(x, y):\n    return x if x < y or x != x else y", "_min = np.minimum"},
    [KMP_OP_MAX] = {"def _max(x, y):\n    return x if x > y or x != x else y", "_max = np.maximum"},
    [KMP_OP_LESS] = {"def _less(x, y):\n    return 1.0 if x < y else 0.0",
                     "def _less(x, y):\n    return np.where(x < y, 1.0, 0.0)"},
    [KMP_OP_SELECT] = {"def _select(c, x, y):\n    return x if c != 0 else y",
                       "def _select(c, x, y):\n    return np.where(c != 0, x, y)"},
    [KMP_OP_TABLE] = {"def _table(table, d, at):\n"
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
                      "    return 2*c[2] + s*(6*c[3]) if d == 2 else 6*c[3] if d == 3 else 0.0",
                      ""}};

static bool says(kmp_op op)
{
    return kmp_op_arity(op) == 0 || functions[op].scalar;
}

static void put_function(kmp_text *text, const kmp_code_source *source, kmp_op op)
{
    (void)source;
    kmp_text_printf(text, "_%s", kmp_op_text(op));
}

static void put_table(kmp_text *text, const kmp_code_source *source, const kmp_routine *r, int table, int derivative)
{
    (void)source;
    kmp_text_printf(text, "_table(_%s_table%d, %d, ", r->name, table, derivative);
}

static const kmp_tongue tongue = {.open = '[',
                                  .close = ']',
                                  .infinity = "math.inf",
                                  .nan = "math.nan",
                                  .division = "_div",
                                  .comment = "#",
                                  .comment_end = "",
                                  .local = "",
                                  .end = "",
                                  .chains = true,
                                  .function = put_function,
                                  .table = put_table};

static bool is_used(const kmp_code_source *source, kmp_op op)
{
    for (int k = 0; k < source->count; k++) {
        const kmp_program *p = source->routines[k].program;
        for (int i = 0; i < p->code[p->stages]; i++)
            if (p->instruction[i].op == op)
                return true;
    }
    return false;
}

/* Defines functions. The preparation of parameters is always scalar, and also accepts the spelling for arrays. */
static void define_functions(kmp_text *text, const kmp_code_source *source)
{
    kmp_text_put(text, "\n\ndef _ieee(function, other):\n"
                       "    def call(*x):\n"
                       "        try:\n"
                       "            return function(*x)\n"
                       "        except (ArithmeticError, ValueError):\n"
                       "            with np.errstate(all='ignore'):\n"
                       "                return float(other(*x))\n"
                       "    return call\n\n\n");
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        if (!functions[op].scalar || !*functions[op].scalar || !is_used(source, (kmp_op)op))
            continue;
        bool vector = source->vectorised && *functions[op].vector;
        const char *definition = vector ? functions[op].vector : functions[op].scalar;
        bool block = strncmp(definition, "def", 3) == 0;
        kmp_text_printf(text, "%s%s\n%s", block ? "\n\n" : "", definition, block ? "\n\n" : "");
    }
    kmp_text_put(text, "\n");
}

/* -- data -------------------------------------------------------------------------------------------- */

static void put_numbers(kmp_text *text, int count, const double *x)
{
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? k % 8 ? ", " : ",\n    " : "");
        kmp_scalar_number(text, &tongue, x[k]);
    }
}

static void define_table(kmp_text *text, const char *routine, int number, const kmp_table *t)
{
    kmp_text_printf(text, "_%s_table%d = ([", routine, number);
    put_numbers(text, t->count, t->x);
    kmp_text_put(text, "], [");
    put_numbers(text, t->count, t->y);
    kmp_text_put(text, "], [");
    for (int k = 0; k < t->count - 1; k++) {
        kmp_text_put(text, k ? ",\n    (" : "(");
        put_numbers(text, 4, t->piece[k]);
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, "])\n");
}

static void define_names(kmp_text *text, const char *what, int count, char *const *names)
{
    kmp_text_printf(text, "%s_names = [", what);
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? k % 8 ? ", " : ",\n    " : "");
        kmp_banner_quote(text, names[k]);
    }
    kmp_text_put(text, "]\n");
}

static void define_data(kmp_text *text, const kmp_code_source *source)
{
    kmp_text_printf(text, "model_hash = \"%s\"\ncoordinate_names = [", source->hash);
    for (int k = 0; k < source->n; k++) {
        kmp_text_put(text, k ? k % 8 ? ", " : ",\n    " : "");
        kmp_banner_quote(text, source->model->motions[k].name);
    }
    kmp_text_put(text, "]\n");
    define_names(text, "row", source->m, source->row_names);
    if (source->parameters) {
        define_names(text, "parameter", source->parameter_count, source->parameter_name);
        kmp_text_put(text, "parameter_values = [");
        put_numbers(text, source->parameter_count, source->value);
        kmp_text_put(text, "]\n");
    }
    for (int k = 0; k < source->count; k++)
        for (int t = 0; t < source->routines[k].program->table_count; t++)
            define_table(text, source->routines[k].name, t, source->routines[k].program->table[t]);
}

/* -- routines ---------------------------------------------------------------------------------------- */

static void begin_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_text_printf(text, "\n\ndef %s(%s", r->name, source->parameters ? "k, t" : "t");
    for (int kind = KMP_IN_Q; kind < KMP_IN_COUNT; kind++)
        if (r->arguments & 1u << kind)
            kmp_text_printf(text, ", %s", kmp_argument_names[kind]);
    kmp_text_put(text, "):\n    \"\"\"Indices count from 0.\n\n");
    kmp_banner_routine(text, source, r, "   ");
    kmp_text_put(text, "    \"\"\"\n");
}

static void begin_arrays(kmp_text *text, const kmp_routine *r)
{
    for (int a = 0; a < r->array_count; a++) {
        const kmp_array *array = &r->arrays[a];
        if (array->cols)
            kmp_text_printf(text, "    %s = np.zeros((%d, %d))\n", array->name, array->rows, array->cols);
        else
            kmp_text_printf(text, "    %s = np.zeros(%d)\n", array->name, array->rows);
    }
}

static void end_routine(kmp_text *text, const kmp_routine *r)
{
    for (int a = 0; a < r->array_count; a++)
        kmp_text_printf(text, "%s%s", a ? ", " : "    return ", r->arrays[a].name);
    kmp_text_put(text, "\n");
}

static bool define_prepare(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_scalar s;
    int at = 0;
    if (!kmp_scalar_init(&s, source, r, 0, &tongue, 0))
        return false;
    kmp_text_printf(
        text,
        "\n\ndef %s_prepare(p=parameter_values):\n    \"\"\"k from the parameters: once, whenever they have "
        "changed.\"\"\"\n    k = [0.0]*%d\n",
        r->name, r->kept_count);
    (void)kmp_scalar_chunk(&s, text, 0, &at);
    kmp_text_put(text, "    return k\n");
    kmp_scalar_free(&s);
    return true;
}

static bool define_scalar(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_scalar s;
    kmp_text body = {0};
    int at = 0;
    if (!kmp_scalar_init(&s, source, r, 1, &tongue, 0))
        return false;
    (void)kmp_scalar_chunk(&s, &body, 0, &at);
    begin_routine(text, source, r);
    for (int kind = KMP_IN_Q; kind < KMP_IN_COUNT; kind++)
        if (s.used & 1u << kind)
            kmp_text_printf(text, "    %s = np.asarray(%s, dtype=float).tolist()\n", kmp_argument_names[kind],
                            kmp_argument_names[kind]);
    begin_arrays(text, r);
    kmp_text_put(text, body.s ? body.s : "");
    end_routine(text, r);
    text->failed = text->failed || body.failed;
    kmp_text_free(&body);
    kmp_scalar_free(&s);
    return true;
}

/* -- vectorised -------------------------------------------------------------------------------------- */

/* _NAME_i = np.array([...]) */
static void define_indices(kmp_text *text, const char *routine, const char *what, int number, int count, const int *x)
{
    kmp_text_printf(text, "_%s_%s%d = np.array([", routine, what, number);
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%d", k ? k % 20 ? ", " : ",\n    " : "", x[k]);
    kmp_text_put(text, "], dtype=np.intp)\n");
}

static void define_signs(kmp_text *text, const char *routine, const char *what, int number, int count,
                         const bool *minus)
{
    kmp_text_printf(text, "_%s_%s%d = np.array([", routine, what, number);
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s", k ? k % 20 ? ", " : ",\n    " : "", minus[k] ? "-1.0" : "1.0");
    kmp_text_put(text, "])\n");
}

static void define_group(kmp_text *text, const kmp_nesting_levels *l, int number)
{
    const kmp_group *g = &l->groups[number];
    static const char *const index[3] = {"a", "b", "c"}, *const sign[3] = {"sa", "sb", "sc"};
    const bool needed[3] = {true, g->op != KMP_OP_MUL || g->multiplies, g->op != KMP_OP_MUL || g->adds};
    for (int k = 0; k < 3 && k < kmp_group_operands(g); k++)
        if (needed[k])
            define_indices(text, l->routine->name, index[k], number, g->count, l->operand[k] + g->start);
    for (int k = 0; k < 3; k++)
        if (g->minus[k])
            define_signs(text, l->routine->name, sign[k], number, g->count, l->minus[k] + g->start);
}

static void put_group(kmp_text *text, const kmp_nesting_levels *l, int number)
{
    const kmp_group *g = &l->groups[number];
    const char *name = l->routine->name;
    kmp_text_printf(text, "        v[%d:%d] = ", g->first, g->first + g->count);
    if (g->op == KMP_OP_MUL) {
        if (g->adds)
            kmp_text_printf(text, "take(_%s_c%d) + ", name, number);
        if (g->minus[0])
            kmp_text_printf(text, "_%s_sa%d*", name, number);
        kmp_text_printf(text, g->multiplies ? "(take(_%s_a%d)*" : "take(_%s_a%d)\n", name, number);
        if (g->multiplies)
            kmp_text_printf(text, "take(_%s_b%d))\n", name, number);
        return;
    }
    if (g->op == KMP_OP_TABLE)
        kmp_text_printf(text, "[_table(_%s_table%u, %u, x) for x in ", name, g->table, g->derivative);
    else
        kmp_text_printf(text, "_%s(", g->op == KMP_OP_DIV ? "div" : kmp_op_text(g->op));
    for (int k = 0; k < kmp_op_arity(g->op); k++) {
        kmp_text_put(text, k ? ", " : "");
        if (g->minus[k])
            kmp_text_printf(text, "_%s_s%c%d*", name, "abc"[k], number);
        kmp_text_printf(text, "take(_%s_%c%d)", name, "abc"[k], number);
    }
    kmp_text_put(text, g->op == KMP_OP_TABLE ? "]\n" : ")\n");
}

/* The sources and targets of an array's entries; `put` receives the assignment. */
static bool define_output(kmp_text *text, kmp_text *put, const kmp_nesting_levels *l, int array)
{
    const char *name = l->routine->name;
    kmp_outputs o;
    if (!kmp_outputs_init(&o, l, array, false))
        return false;
    if (o.count > 0) {
        define_indices(text, name, "to", array, o.count, o.to);
        define_indices(text, name, "from", array, o.count, o.from);
        kmp_text_printf(put, "    %s.flat[_%s_to%d] = ", l->routine->arrays[array].name, name, array);
        if (o.signs) {
            define_signs(text, name, "sign", array, o.count, o.minus);
            kmp_text_printf(put, "_%s_sign%d*", name, array);
        }
        kmp_text_printf(put, "take(_%s_from%d)\n", name, array);
    }
    kmp_outputs_free(&o);
    return true;
}

static bool define_tables_of_levels(kmp_text *text, kmp_text *put, const kmp_nesting_levels *l)
{
    bool ok = true;
    kmp_text_printf(text, "\n\n# %s: %d values in %d steps, %d statements\n_%s_v = np.zeros(%d)\n_%s_v[:%d] = [",
                    l->routine->name, l->size, l->steps, l->group_count, l->routine->name, l->size, l->routine->name,
                    l->number_count);
    put_numbers(text, l->number_count, l->numbers);
    kmp_text_put(text, "]\n");
    for (int k = 0; k < l->group_count; k++)
        define_group(text, l, k);
    for (int a = 0; a < l->routine->array_count && ok; a++)
        ok = define_output(text, put, l, a);
    return ok;
}

static bool define_vectorised(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_nesting_levels l;
    kmp_text put = {0};
    if (!kmp_levels_init(&l, source, r))
        return false;
    bool ok = define_tables_of_levels(text, &put, &l);
    begin_routine(text, source, r);
    kmp_text_printf(text, "    v = _%s_v.copy()\n    take = v.take\n", r->name);
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (l.width[kind])
            kmp_text_printf(text, "    v[%d:%d] = %s\n", l.at[kind], l.at[kind] + l.width[kind],
                            kmp_argument_names[kind]);
    kmp_text_put(text, l.group_count ? "    with np.errstate(all='ignore'):\n" : "");
    for (int k = 0; k < l.group_count; k++)
        put_group(text, &l, k);
    begin_arrays(text, r);
    kmp_text_put(text, put.s ? put.s : "");
    end_routine(text, r);
    text->failed = text->failed || put.failed;
    kmp_text_free(&put);
    kmp_levels_free(&l);
    return ok;
}

/* -- the file ---------------------------------------------------------------------------------------- */

static bool write_files(const kmp_code_source *source, kmp_code_files *files)
{
    kmp_text *text = kmp_code_add(files, source->name, ".py");
    bool ok = text;
    if (!text)
        return false;
    kmp_banner_put(text, source, "#", 0);
    kmp_text_put(text, "import bisect\nimport math\nimport operator\n\nimport numpy as np\n\n");
    define_data(text, source);
    define_functions(text, source);
    for (int k = 0; k < source->count && ok; k++) {
        const kmp_routine *r = &source->routines[k];
        ok = !source->parameters || define_prepare(text, source, r);
        if (ok)
            ok = source->vectorised ? define_vectorised(text, source, r) : define_scalar(text, source, r);
    }
    return ok;
}

const kmp_language kmp_language_python = {.name = "python", .vectorises = true, .says = says, .write = write_files};
