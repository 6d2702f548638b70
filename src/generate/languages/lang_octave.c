/* SPDX-License-Identifier: BSD-3-Clause */
/* Octave and MATLAB: a function file for each routine, NAME_SET.m, one more for its parameters, and NAME_model.m with
 * the names. Square roots and logarithms of negative numbers are complex in these languages; here they are NaN. */
#include "generate/banner.h"
#include "generate/languages/levels.h"
#include "generate/scalar.h"
#include "symbolic/table.h"
#include <string.h>

/* -- functions --------------------------------------------------------------------------------------- */

/* By operation: its name, for arrays too, and its definition where the language has none. */
static const struct {
    const char *name, *definition;
} functions[KMP_OP_COUNT] = {
    [KMP_OP_ADD] = {"", NULL},
    [KMP_OP_MUL] = {"", NULL},
    [KMP_OP_DIV] = {"rdivide", NULL},
    [KMP_OP_SIN] = {"sin", NULL},
    [KMP_OP_COS] = {"cos", NULL},
    [KMP_OP_SQRT] = {"kempe_sqrt", "function y = kempe_sqrt(x)\n    x(x < 0) = NaN;\n    y = sqrt(x);\nend\n"},
    [KMP_OP_EXP] = {"exp", NULL},
    [KMP_OP_LOG] = {"kempe_log", "function y = kempe_log(x)\n    x(x < 0) = NaN;\n    y = log(x);\nend\n"},
    [KMP_OP_SINH] = {"sinh", NULL},
    [KMP_OP_COSH] = {"cosh", NULL},
    [KMP_OP_TANH] = {"tanh", NULL},
    [KMP_OP_ASIN] = {"kempe_asin", "function y = kempe_asin(x)\n    x(abs(x) > 1) = NaN;\n    y = asin(x);\nend\n"},
    [KMP_OP_ACOS] = {"kempe_acos", "function y = kempe_acos(x)\n    x(abs(x) > 1) = NaN;\n    y = acos(x);\nend\n"},
    [KMP_OP_ATAN] = {"atan", NULL},
    [KMP_OP_ABS] = {"abs", NULL},
    [KMP_OP_SIGN] = {"sign", NULL},
    [KMP_OP_POW] = {"kempe_pow",
                    "function z = kempe_pow(x, y)\n    x(x < 0 & y ~= fix(y)) = NaN;\n    z = x.^y;\nend\n"},
    [KMP_OP_ATAN2] = {"atan2", NULL},
    [KMP_OP_MIN] = {"kempe_min", "function z = kempe_min(x, y)\n    z = min(x, y);\n    z(isnan(x) | isnan(y)) = NaN;\n"
                                 "end\n"},
    [KMP_OP_MAX] = {"kempe_max", "function z = kempe_max(x, y)\n    z = max(x, y);\n    z(isnan(x) | isnan(y)) = NaN;\n"
                                 "end\n"},
    [KMP_OP_LESS] = {"kempe_less", "function z = kempe_less(x, y)\n    z = double(x < y);\nend\n"},
    [KMP_OP_SELECT] = {"kempe_select", "function z = kempe_select(c, x, y)\n    z = y;\n    k = c ~= 0;\n"
                                       "    z(k) = x(k);\nend\n"},
    [KMP_OP_TABLE] = {"", "function v = kempe_table(x, y, c, d, at)\n"
                          "    v = at;\n"
                          "    last = numel(x) - 1;\n"
                          "    for n = 1:numel(at)\n"
                          "        s = at(n);\n"
                          "        if s < x(1)\n"
                          "            slopes = [y(1) + c(1, 2)*(s - x(1)), c(1, 2), 0, 0];\n"
                          "            v(n) = slopes(d + 1);\n"
                          "        elseif s > x(end)\n"
                          "            slope = kempe_piece(c(last, :), 1, x(end) - x(last));\n"
                          "            slopes = [y(end) + slope*(s - x(end)), slope, 0, 0];\n"
                          "            v(n) = slopes(d + 1);\n"
                          "        elseif s == s\n"
                          "            k = min(find(x <= s, 1, 'last'), last);\n"
                          "            v(n) = kempe_piece(c(k, :), d, s - x(k));\n"
                          "        end\n"
                          "    end\n"
                          "end\n\n"
                          "function v = kempe_piece(c, d, s)\n"
                          "    if d == 0\n"
                          "        v = c(1) + s*(c(2) + s*(c(3) + s*c(4)));\n"
                          "    elseif d == 1\n"
                          "        v = c(2) + s*(2*c(3) + s*(3*c(4)));\n"
                          "    elseif d == 2\n"
                          "        v = 2*c(3) + s*(6*c(4));\n"
                          "    else\n"
                          "        v = 6*c(4);\n"
                          "    end\n"
                          "end\n"}};

static bool says(kmp_op op)
{
    return kmp_op_arity(op) == 0 || functions[op].name;
}

static void put_function(kmp_text *text, const kmp_code_source *source, kmp_op op)
{
    (void)source;
    kmp_text_put(text, functions[op].name);
}

static void put_table(kmp_text *text, const kmp_code_source *source, const kmp_routine *r, int table, int derivative)
{
    (void)source;
    (void)r;
    kmp_text_printf(text, "table%d(%d, ", table, derivative);
}

static const kmp_tongue tongue = {.open = '(',
                                  .close = ')',
                                  .base = 1,
                                  .infinity = "Inf",
                                  .nan = "NaN",
                                  .comment = "%",
                                  .comment_end = "",
                                  .local = "",
                                  .end = ";",
                                  .function = put_function,
                                  .table = put_table};

/* -- data -------------------------------------------------------------------------------------------- */

static void put_gap(kmp_text *text, int k, int a_line)
{
    kmp_text_put(text, k == 0 ? "" : k % a_line ? ", " : ", ...\n        ");
}

static void put_numbers(kmp_text *text, int count, const double *x)
{
    kmp_text_put(text, "[");
    for (int k = 0; k < count; k++) {
        put_gap(text, k, 8);
        kmp_scalar_number(text, &tongue, x[k]);
    }
    kmp_text_put(text, "]");
}

/* A string in single quotes, as both languages read it. */
static void put_string(kmp_text *text, const char *s)
{
    kmp_text_put(text, "'");
    for (; *s; s++) {
        kmp_text_put(text, *s == '\'' ? "'" : "");
        kmp_text_printf(text, "%c", (unsigned char)*s < 0x20 ? ' ' : *s);
    }
    kmp_text_put(text, "'");
}

static void define_table(kmp_text *text, int number, const kmp_table *t)
{
    kmp_text_printf(text, "\nfunction v = table%d(d, at)\n    x = ", number);
    put_numbers(text, t->count, t->x);
    kmp_text_put(text, ";\n    y = ");
    put_numbers(text, t->count, t->y);
    kmp_text_put(text, ";\n    c = [");
    for (int k = 0; k < t->count - 1; k++) {
        kmp_text_put(text, k ? "; ...\n        " : "");
        for (int j = 0; j < 4; j++) {
            kmp_text_put(text, j ? ", " : "");
            kmp_scalar_number(text, &tongue, t->piece[k][j]);
        }
    }
    kmp_text_put(text, "];\n    v = kempe_table(x, y, c, d, at);\nend\n");
}

/* The functions that a program needs, at the end of its file. */
static void define_functions(kmp_text *text, const kmp_program *p)
{
    for (int t = 0; t < p->table_count; t++)
        define_table(text, t, p->table[t]);
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        bool used = false;
        for (int i = 0; i < p->code[p->stages]; i++)
            used = used || p->instruction[i].op == op;
        if (used && functions[op].definition)
            kmp_text_printf(text, "\n%s", functions[op].definition);
    }
}

static void put_names(kmp_text *text, const char *field, int count, char *const *names)
{
    kmp_text_printf(text, "    m.%s = {", field);
    for (int k = 0; k < count; k++) {
        put_gap(text, k, 8);
        put_string(text, names[k]);
    }
    kmp_text_put(text, "};\n");
}

static bool write_model(const kmp_code_source *source, kmp_code_files *files)
{
    kmp_text *text = kmp_code_add(files, source->name, "_model.m");
    if (!text)
        return false;
    kmp_banner_put(text, source, "%", 1);
    kmp_text_printf(text, "function m = %s_model()\n    m.hash = '%s';\n    m.coordinate_names = {", source->name,
                    source->hash);
    for (int k = 0; k < source->n; k++) {
        put_gap(text, k, 8);
        put_string(text, source->model->motions[k].name);
    }
    kmp_text_put(text, "};\n");
    put_names(text, "row_names", source->m, source->row_names);
    put_names(text, "parameter_names", source->parameter_count, source->parameter_name);
    kmp_text_put(text, "    m.parameter_values = ");
    put_numbers(text, source->parameter_count, source->value);
    kmp_text_put(text, ";\nend\n");
    return true;
}

/* -- routines ---------------------------------------------------------------------------------------- */

static kmp_text *add_file(const kmp_code_source *source, const kmp_routine *r, const char *ending,
                          kmp_code_files *files)
{
    kmp_text name = {0};
    kmp_text_printf(&name, "%s_%s", source->name, r->name);
    kmp_text *text = name.failed ? NULL : kmp_code_add(files, name.s, ending);
    kmp_text_free(&name);
    if (text)
        kmp_text_printf(text, "%% Equations of the model in %s_model.m; hash %s; written by Kempe " KEMPE_VERSION "\n",
                        source->name, source->hash);
    return text;
}

static void begin_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    const kmp_tally *t = &r->tally;
    kmp_text_printf(text, "%% operations: %ld; with signs and functions %ld; of these %ld for the parameters\n",
                    t->counts.paper, t->counts.robotran, t->counts.robotran - t->runtime.robotran);
    kmp_banner_routine(text, source, r, "%");
    kmp_text_put(text, "function [");
    for (int a = 0; a < r->array_count; a++)
        kmp_text_printf(text, "%s%s", a ? ", " : "", r->arrays[a].name);
    kmp_text_printf(text, "] = %s_%s(%s", source->name, r->name, source->parameters ? "k, t" : "t");
    for (int kind = KMP_IN_Q; kind < KMP_IN_COUNT; kind++)
        if (r->arguments & 1u << kind)
            kmp_text_printf(text, ", %s", kmp_argument_names[kind]);
    kmp_text_put(text, ")\n");
}

static void begin_arrays(kmp_text *text, const kmp_routine *r)
{
    for (int a = 0; a < r->array_count; a++)
        kmp_text_printf(text, "    %s = zeros(%d, %d);\n", r->arrays[a].name, r->arrays[a].rows,
                        r->arrays[a].cols ? r->arrays[a].cols : 1);
}

static bool write_prepare(const kmp_code_source *source, const kmp_routine *r, kmp_code_files *files)
{
    kmp_scalar s;
    int at = 0;
    kmp_text *text = add_file(source, r, "_prepare.m", files);
    if (!text || !kmp_scalar_init(&s, source, r, 0, &tongue, 0))
        return false;
    kmp_text_printf(text,
                    "%% k of %s_%s from the parameters (those of the model when none are given): once, whenever they "
                    "have changed\nfunction k = %s_%s_prepare(p)\n    if nargin < 1\n        p = "
                    "%s_model().parameter_values;\n    end\n    k = zeros(1, %d);\n",
                    source->name, r->name, source->name, r->name, source->name, r->kept_count);
    (void)kmp_scalar_chunk(&s, text, 0, &at);
    kmp_text_put(text, "end\n");
    define_functions(text, r->program);
    kmp_scalar_free(&s);
    return true;
}

static bool put_scalar(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_scalar s;
    int at = 0;
    if (!kmp_scalar_init(&s, source, r, 1, &tongue, 0))
        return false;
    begin_arrays(text, r);
    (void)kmp_scalar_chunk(&s, text, 0, &at);
    kmp_scalar_free(&s);
    return true;
}

/* -- vectorised -------------------------------------------------------------------------------------- */

/* "v([1, 2, 3])"; "v(1)" */
static void put_gather(kmp_text *text, int count, const int *x)
{
    kmp_text_put(text, count == 1 ? "v(" : "v([");
    for (int k = 0; k < count; k++) {
        put_gap(text, k, 20);
        kmp_text_printf(text, "%d", x[k] + 1);
    }
    kmp_text_put(text, count == 1 ? ")" : "])");
}

/* 1 and -1 as "([2, 0] - 1).*": Octave stores a list of plain numbers as a constant, but builds a list with signs at
 * each evaluation.
 */
static void put_signs(kmp_text *text, int count, const bool *minus)
{
    kmp_text_put(text, "([");
    for (int k = 0; k < count; k++) {
        put_gap(text, k, 20);
        kmp_text_put(text, minus[k] ? "0" : "2");
    }
    kmp_text_put(text, "] - 1).*");
}

static void put_fused(kmp_text *text, const kmp_nesting_levels *l, const kmp_group *g)
{
    if (g->adds) {
        put_gather(text, g->count, l->operand[2] + g->start);
        kmp_text_put(text, " + ");
    }
    if (g->minus[0])
        put_signs(text, g->count, l->minus[0] + g->start);
    kmp_text_put(text, g->multiplies ? "(" : "");
    put_gather(text, g->count, l->operand[0] + g->start);
    if (g->multiplies) {
        kmp_text_put(text, ".*");
        put_gather(text, g->count, l->operand[1] + g->start);
        kmp_text_put(text, ")");
    }
}

static void put_group(kmp_text *text, const kmp_nesting_levels *l, const kmp_group *g)
{
    if (g->count == 1)
        kmp_text_printf(text, "    v(%d) = ", g->first + 1);
    else
        kmp_text_printf(text, "    v(%d:%d) = ", g->first + 1, g->first + g->count);
    if (g->op == KMP_OP_MUL) {
        put_fused(text, l, g);
    } else {
        if (g->op == KMP_OP_TABLE)
            kmp_text_printf(text, "table%u(%u, ", g->table, g->derivative);
        else
            kmp_text_printf(text, "%s(", functions[g->op].name);
        for (int k = 0; k < kmp_group_operands(g); k++) {
            kmp_text_put(text, k ? ", " : "");
            if (g->minus[k])
                put_signs(text, g->count, l->minus[k] + g->start);
            put_gather(text, g->count, l->operand[k] + g->start);
        }
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, ";\n");
}

static bool put_output(kmp_text *text, const kmp_nesting_levels *l, int array)
{
    kmp_outputs o;
    if (!kmp_outputs_init(&o, l, array, true))
        return false;
    if (o.count > 0) {
        kmp_text_printf(text, "    %s([", l->routine->arrays[array].name);
        for (int k = 0; k < o.count; k++) {
            put_gap(text, k, 20);
            kmp_text_printf(text, "%d", o.to[k] + 1);
        }
        kmp_text_put(text, "]) = ");
        if (o.signs)
            put_signs(text, o.count, o.minus);
        put_gather(text, o.count, o.from);
        kmp_text_put(text, ";\n");
    }
    kmp_outputs_free(&o);
    return true;
}

static bool put_vectorised(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_nesting_levels l;
    bool ok = true;
    if (!kmp_levels_init(&l, source, r))
        return false;
    kmp_text_printf(text, "    %% %d values in %d steps, %d statements\n    v = zeros(1, %d);\n    v(1:%d) = ", l.size,
                    l.steps, l.group_count, l.size, l.number_count);
    put_numbers(text, l.number_count, l.numbers);
    kmp_text_put(text, ";\n");
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (l.width[kind])
            kmp_text_printf(text, "    v(%d:%d) = %s;\n", l.at[kind] + 1, l.at[kind] + l.width[kind],
                            kmp_argument_names[kind]);
    for (int k = 0; k < l.group_count; k++)
        put_group(text, &l, &l.groups[k]);
    begin_arrays(text, r);
    for (int a = 0; a < r->array_count && ok; a++)
        ok = put_output(text, &l, a);
    kmp_levels_free(&l);
    return ok;
}

/* -- the files --------------------------------------------------------------------------------------- */

static bool write_routine(const kmp_code_source *source, const kmp_routine *r, kmp_code_files *files)
{
    kmp_text *text = add_file(source, r, ".m", files);
    if (!text)
        return false;
    begin_routine(text, source, r);
    bool ok = source->vectorised ? put_vectorised(text, source, r) : put_scalar(text, source, r);
    kmp_text_put(text, "end\n");
    define_functions(text, r->program);
    return ok;
}

static bool write_files(const kmp_code_source *source, kmp_code_files *files)
{
    bool ok = write_model(source, files);
    for (int k = 0; k < source->count && ok; k++) {
        const kmp_routine *r = &source->routines[k];
        ok = write_routine(source, r, files) && (!source->parameters || write_prepare(source, r, files));
    }
    return ok;
}

const kmp_language kmp_language_octave = {.name = "octave", .vectorises = true, .says = says, .write = write_files};
