/* SPDX-License-Identifier: BSD-3-Clause */
/* Octave and MATLAB: a function file for each routine, NAME_SET.m, one more for its parameters, and NAME_model.m with
 * the names. Square roots and logarithms of negative numbers are complex in these languages; here they are NaN. */
#include "exchange/code/block_parts.h"
#include "exchange/code/language.h"
#include "exchange/code/write.h"

static const kmp_function_spelling functions[KMP_OP_COUNT] = {
    [KMP_OP_DIV] = {.call = "rdivide"}, /* of arrays */
    [KMP_OP_SIN] = {.call = "sin"},
    [KMP_OP_COS] = {.call = "cos"},
    [KMP_OP_SQRT] = {.call = "kempe_sqrt",
                     .definition = "\nfunction y = kempe_sqrt(x)\n    x(x < 0) = NaN;\n    y = sqrt(x);\nend\n"},
    [KMP_OP_EXP] = {.call = "exp"},
    [KMP_OP_LOG] = {.call = "kempe_log",
                    .definition = "\nfunction y = kempe_log(x)\n    x(x < 0) = NaN;\n    y = log(x);\nend\n"},
    [KMP_OP_SINH] = {.call = "sinh"},
    [KMP_OP_COSH] = {.call = "cosh"},
    [KMP_OP_TANH] = {.call = "tanh"},
    [KMP_OP_ASIN] = {.call = "kempe_asin",
                     .definition = "\nfunction y = kempe_asin(x)\n    x(abs(x) > 1) = NaN;\n    y = asin(x);\nend\n"},
    [KMP_OP_ACOS] = {.call = "kempe_acos",
                     .definition = "\nfunction y = kempe_acos(x)\n    x(abs(x) > 1) = NaN;\n    y = acos(x);\nend\n"},
    [KMP_OP_ATAN] = {.call = "atan"},
    [KMP_OP_ABS] = {.call = "abs"},
    [KMP_OP_SIGN] = {.call = "sign"},
    [KMP_OP_FLOOR] = {.call = "floor"},
    [KMP_OP_POW] = {.call = "kempe_pow",
                    .definition =
                        "\nfunction z = kempe_pow(x, y)\n    x(x < 0 & y ~= fix(y)) = NaN;\n    z = x.^y;\nend\n"},
    [KMP_OP_ATAN2] = {.call = "atan2"},
    [KMP_OP_MIN] = {.call = "kempe_min",
                    .definition =
                        "\nfunction z = kempe_min(x, y)\n    z = min(x, y);\n    z(isnan(x) | isnan(y)) = NaN;\n"
                        "end\n"},
    [KMP_OP_MAX] = {.call = "kempe_max",
                    .definition =
                        "\nfunction z = kempe_max(x, y)\n    z = max(x, y);\n    z(isnan(x) | isnan(y)) = NaN;\n"
                        "end\n"},
    [KMP_OP_LESS] = {.call = "kempe_less",
                     .definition = "\nfunction z = kempe_less(x, y)\n    z = double(x < y);\nend\n"},
    [KMP_OP_SELECT] = {.call = "kempe_select",
                       .definition = "\nfunction z = kempe_select(c, x, y)\n    z = y;\n    k = c ~= 0;\n"
                                     "    z(k) = x(k);\nend\n"},
    [KMP_OP_TABLE] = {.definition = "\nfunction v = kempe_interpolate(x, y, c, d, at)\n"
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
                                    "end\n"},
    [KMP_OP_IMPLICIT] = {.definition = "\n$(newton)"}};

/* -- implicit blocks ----------------------------------------------------------------------------------- */

/* Values by place of a part as a matrix. */
static void put_rows(const kmp_code_writer *w, const struct kmp_code_block *b, kmp_block_part part)
{
    const kmp_place_values *rows = &b->rows[part];
    kmp_text_printf(w->text, "        %s_rows = [", kmp_block_part_names[part]);
    for (int k = 0; k < b->block->candidates; k++)
        for (int i = 0; i < rows->width; i++) {
            kmp_text_put(w->text, i > 0 ? ", " : k > 0 ? "; ...\n            " : "");
            kmp_language_number(w->text, w->language, rows->rows[k * rows->width + i]);
        }
    kmp_text_put(w->text, "];\n");
}

/* Matrices that a function keeps. */
static void put_all_rows(const kmp_code_writer *w, const struct kmp_code_block *b)
{
    const char *first = NULL;
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->rows[k].width > 0) {
            kmp_text_printf(w->text, "%s %s_rows", first ? "" : "    persistent", kmp_block_part_names[k]);
            first = first ? first : kmp_block_part_names[k];
        }
    if (!first)
        return;
    kmp_text_printf(w->text, "\n    if isempty(%s_rows)\n", first);
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->rows[k].width > 0)
            put_rows(w, b, (kmp_block_part)k);
    kmp_text_put(w->text, "    end\n");
}

static void put_block(const kmp_code_writer *w, const struct kmp_code_block *b, int number)
{
    const bool averages = b->block->averages;
    kmp_text_printf(w->text, "\nfunction y = block%d(p)\n", number);
    put_all_rows(w, b);
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program)
            kmp_text_printf(w->text, "    %s = %s_prepare(p);\n", kmp_block_part_names[k], b->part[k].inner);
    kmp_text_printf(w->text, "    y = %s(%d, %s", averages ? "kempe_average" : "kempe_solve", b->block->unknowns,
                    averages                           ? "guess_rows, equations_rows"
                    : b->rows[KMP_PART_SCAN].width > 0 ? "scan_rows"
                                                       : "[]");
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program) /* with its numbers of these arguments, ", @(q) M_C_block0_scan(scan, q)" */
            kmp_text_printf(w->text, ", @(q) %s(%s, q)", b->part[k].inner, kmp_block_part_names[k]);
        else if (!averages)
            kmp_text_put(w->text, ", []");
    kmp_text_put(w->text, ");\nend\n");
}

/* -- files ------------------------------------------------------------------------------------------- */

static const char model[] =
    "$(banner)function m = $(name)_model()\n"
    "    m.hash = '$(hash)';\n"
    "    m.coordinate_names = $(coordinate names);\n"
    "    m.row_names = $(row names);\n"
    "$(if given)    m.input_names = $(input names);\n$(end)"
    "$(if shown)    m.output_names = $(output names);\n$(end)"
    "$(if frictions)    m.friction_names = $(friction names);\n"
    "    m.friction_rows = $(friction rows);\n    m.friction_modes = $(friction modes);\n$(end)"
    "$(if contacts)    m.contact_names = $(contact names);\n"
    "    m.contact_rows = $(contact rows);\n    m.contact_modes = $(contact modes);\n$(end)"
    "$(if elements)    m.mode_entries = $(mode entries);\n    m.elements = $(elements);\n$(end)"
    "$(if discrete)    m.discrete_names = $(discrete names);\n"
    "    m.discrete_places = $(discrete places);\n    m.sample_times = $(discrete times);\n$(end)"
    "$(if delays)    m.delay_names = $(delay names);\n"
    "    m.delay_places = $(delay places);\n    m.delay_given = $(delay given);\n$(end)"
    "    m.parameter_names = $(parameter names);\n"
    "    m.parameter_values = $(values);\n"
    "end\n";

#define ORIGIN "% Equations of the model in $(name)_model.m; hash $(hash); written by Kempe " KEMPE_VERSION "\n"
#define HEAD                                                                                                           \
    ORIGIN "% operations: $(paper); with signs and functions $(robotran); of these $(once) for the parameters\n"       \
           "$(about)function [$(each array)$(comma)$(array)$(end)] = $(name)_$(routine)($(each "                       \
           "input)$(comma)$(argument)$(end))\n"
#define ZEROS "$(each array)    $(array) = zeros($(height), $(columns or 1));\n$(end)"
#define TAIL                                                                                                           \
    "end\n$(each own table)\nfunction v = table$(shared table)(d, at)\n    persistent x y c\n    if isempty(x)\n"      \
    "        x = $(x);\n        y = $(y);\n        c = $(pieces);\n    end\n"                                          \
    "    v = kempe_interpolate(x, y, c, d, at);\nend\n$(end)$(functions)"

const kmp_language kmp_language_octave = {
    .name = "octave",
    .title = "Octave",
    .infinity = "Inf",
    .nan = "NaN",
    .quote = '\'',
    .escape = '\'',
    .escaped = "'",
    .names = {"{", "}", ", ", ", ...\n        ", 8},
    .numbers = {"[", "]", ", ", ", ...\n        ", 8},
    .places = {"[", "]", ", ", ", ...\n        ", 20},
    .pieces = {"[", "]", "; ...\n        ", NULL, 0},
    .piece = {"", "", ", ", NULL, 0},
    .open = '(',
    .close = ')',
    .base = 1,
    .local = "",
    .end = ";",
    .comment = "%",
    .comment_end = "",
    .mark = "%",
    .routine_mark = "%",
    .table_call = "table$(shared table)($(derivative), ",
    .functions = functions,
    .prepare = ORIGIN "% k of $(name)_$(routine) from the parameters (those of the model when none are given): once, "
                      "whenever they have changed\nfunction k = $(name)_$(routine)_prepare(p)\n"
                      "    if nargin < 1\n        p = $(name)_model().parameter_values;\n    end\n"
                      "    k = zeros(1, $(kept));\n$(statements)" TAIL,
    .function = HEAD ZEROS "$(statements)" TAIL "$(blocks)",
    .inner_prepare = "\nfunction k = $(routine)_prepare(p)\n    k = zeros(1, $(kept));\n$(statements)end\n",
    .inner_function = "\nfunction f = $(routine)(k, q)\n$(each array)    $(array) = zeros(1, $(height));\n$(end)"
                      "$(statements)end\n",
    .block = put_block,
    .solve = "    $(what) = block$(number)([$(argument)]);\n",
    .newton = KMP_RUNTIME_NEWTON_OCTAVE,
    .arrays = {.function = HEAD "    % $(size) values in $(steps) steps, $(group count) statements\n"
                                "    v = zeros(1, $(size));\n"
                                "    v(1:$(constant count)) = $(constants);\n"
                                "$(each input)$(if width)    v($(first):$(last)) = $(argument);\n$(end)$(end)"
                                "$(groups)" ZEROS "$(scatter)" TAIL,
               .range = "    v($(first):$(last)) = ",
               .one = "    v($(first)) = ",
               .gather = "v($(places))",
               .gather_one = "v($(first))",
               /* Octave stores a list of plain numbers as a constant, but builds a list with signs each time */
               .signs = "($(signs) - 1).*",
               .plus = "2",
               .minus = "0",
               .scatter = "    $(array)($(places)) = ",
               .times = ".*",
               .by_columns = true},
    .pages = {{"$(name)_model.m", model}},
    .routine_pages = {{"$(name)_$(routine).m", "$(function)"},
                      {"$(if prepared)$(name)_$(routine)_prepare.m$(end)", "$(prepare)"}}};
