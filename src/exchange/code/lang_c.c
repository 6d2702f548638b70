/* SPDX-License-Identifier: BSD-3-Clause */
/* C99: NAME.h and NAME.c, which needs libm and kempe_runtime.h in the same folder. Compiled without contraction it
 * computes the bits of the tape. A long routine is a sequence of functions of CHUNK statements. Compile time grows
 * faster than length (gcc -O1, 84 000 operations: 4.6 s by 250, 6.2 s by 1000). Calls are as fast. Values that several
 * functions read are in an array of their caller. */
#include "exchange/code/block_parts.h"
#include "exchange/code/language.h"
#include "exchange/code/write.h"
#include "symbolic/ops.h"
#include <stdio.h>
#include <string.h>

enum { CHUNK = 250 };

/* -- functions --------------------------------------------------------------------------------------- */

/* The expression of an operation in C. */
static const char *const values[KMP_OP_COUNT] = {
#define KMP_LEAF(name)                                       NULL,
#define KMP_BINARY(name, text, value)                        #value,
#define KMP_UNARY(name, text, parity, value, derivative)     #value,
#define KMP_BINARY_FUNCTION(name, text, value, differential) #value,
#define KMP_TERNARY(name, text, value, differential)         #value,
#define KMP_APPLIED(name, text)                              NULL,
#include "symbolic/ops_end.h"
};

/* True if the operation is a function of libm: its value is a call. */
static bool is_in_libm(kmp_op op)
{
    static const char *const operands[4] = {"", "x", "x, y", "x, y, z"};
    char text[32];
    snprintf(text, sizeof text, "%s(%s)", kmp_op_text(op), operands[kmp_op_arity(op)]);
    return values[op] && strcmp(values[op], text) == 0;
}

static void call(const kmp_code_writer *w, kmp_op op)
{
    if (!is_in_libm(op))
        kmp_text_printf(w->text, "%s_", w->source->name);
    kmp_text_put(w->text, kmp_op_text(op));
}

static void define(const kmp_code_writer *w, kmp_op op)
{
    static const char *const parameters[4] = {"void", "double x", "double x, double y", "double x, double y, double z"};
    if (kmp_op_form_of(op) == KMP_FORM_FUNCTION && op != KMP_OP_SIN && op != KMP_OP_COS && !is_in_libm(op))
        kmp_text_printf(w->text, "static double %s_%s(%s)\n{\n    return %s;\n}\n\n", w->source->name, kmp_op_text(op),
                        parameters[kmp_op_arity(op)], values[op]);
}

/* -- implicit blocks ----------------------------------------------------------------------------------- */

/* Of each part of a block in its room: "double guess[3], equations[2]". */
static void put_kept(kmp_text *text, const struct kmp_code_block *b)
{
    const char *before = "    double ";
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program) {
            const int kept = b->part[k].kept_count;
            kmp_text_printf(text, "%s%s[%d]", before, kmp_block_part_names[k], kept > 0 ? kept : 1);
            before = ", ";
        }
}

static void put_preparation(kmp_text *text, const struct kmp_code_block *b, const char *name)
{
    for (int k = 0; k < KMP_BLOCK_PARTS; k++)
        if (b->part[k].program)
            kmp_text_printf(text, "    %s_%s_prepare(p, r.%s);\n", name, kmp_block_part_names[k],
                            kmp_block_part_names[k]);
}

/* Values by place of a part that has some. */
static void put_rows(kmp_text *text, const struct kmp_code_block *b, kmp_block_part part, const char *name)
{
    const kmp_place_values *rows = &b->rows[part];
    if (rows->width <= 1)
        return;
    kmp_text_printf(text, "static const double %s_%s_rows[] = ", name, kmp_block_part_names[part]);
    kmp_put_numbers(text, &kmp_language_c, &kmp_language_c.numbers, rows->width * b->block->candidates, rows->rows);
    kmp_text_put(text, ";\n\n");
}

/* A function of kmp_places: a part of the block at a place, with the row of the place. */
static void put_at_place(kmp_text *text, const struct kmp_code_block *b, kmp_block_part number, const char *name,
                         const char *function, const char *result)
{
    const int width = b->rows[number].width;
    const char *part = kmp_block_part_names[number];
    put_rows(text, b, number, name);
    kmp_text_printf(text, "static void %s_%s(void *self, const double *place, double *%s)\n{\n    %s_room *r = self;\n",
                    name, function, result, name);
    kmp_text_printf(text, "    %s_%s(r->%s, ", name, part, part);
    if (width > 1)
        kmp_text_printf(text, "%s_%s_rows + %d * (place - %s_candidates)", name, part, width, name);
    else
        kmp_text_put(text, "place");
    kmp_text_printf(text, ", %s);\n}\n\n", result);
}

/* Merits at all candidates: q has the candidate, guesses of the other unknowns, then values by place. */
static void put_merits(kmp_text *text, const struct kmp_code_block *b, const char *name)
{
    const kmp_program_block *block = b->block;
    const int n = block->unknowns, more = b->rows[KMP_PART_SCAN].width - 1;
    put_rows(text, b, KMP_PART_SCAN, name);
    kmp_text_printf(text, "static const double *%s_merits(void *self)\n{\n    %s_room *r = self;\n", name, name);
    kmp_text_printf(text, "    for (int k = 0; k < %d; k++) {\n        double q[%d] = {%s_candidates[k]};\n",
                    block->candidates, n + more, name);
    if (n > 1)
        kmp_text_printf(text, "        %s_begin(self, q);\n", name);
    if (more > 0)
        kmp_text_printf(text, "        memcpy(q + %d, %s_scan_rows + %d * k + 1, %d * sizeof *q);\n", n, name, more + 1,
                        more);
    kmp_text_printf(text, "        %s_scan(r->scan, q, &r->merits[k]);\n    }\n    return r->merits;\n}\n\n", name);
}

/* The functions that Newton's method calls. */
static void put_callbacks(kmp_text *text, const struct kmp_code_block *b, const char *name)
{
    const int n = b->block->unknowns, among = b->block->candidates > 0;
    const char *type = "_room *r = self;\n";
    kmp_text_printf(text, "static void %s_begin(void *self, double *y)\n{\n    %s%s", name, name, type);
    kmp_text_printf(text, "    %s_guess(r->guess, y, r->f);\n", name);
    kmp_text_printf(text, "    memcpy(y + %d, r->f + %d, %d * sizeof *y);\n}\n\n", among, among, n - among);
    kmp_text_printf(text, "static const double *%s_at(void *self, const double *y, double *merit)\n{\n    %s%s", name,
                    name, type);
    if (among)
        kmp_text_printf(text, "    %s_merit(r->merit, y, merit);\n", name);
    else
        kmp_text_put(text, "    (void)merit;\n");
    kmp_text_printf(text, "    %s_equations(r->equations, y, r->f);\n    return r->f;\n}\n\n", name);
    if (among)
        put_merits(text, b, name);
}

/* Sums over places. */
static void put_average(kmp_text *text, const struct kmp_code_block *b, const char *name)
{
    const kmp_program_block *block = b->block;
    const int n = block->unknowns, places = block->candidates, groups = (places + 7) / 8;
    kmp_text_printf(text, "typedef struct %s_room {\n", name);
    put_kept(text, b);
    kmp_text_printf(text, ";\n} %s_room;\n\n", name);
    put_at_place(text, b, KMP_PART_GUESS, name, "exponent", "e");
    put_at_place(text, b, KMP_PART_EQUATIONS, name, "averaged", "value");
    kmp_text_printf(text,
                    "/* The logarithm of the sum, and the averages, for the arguments p. */\n"
                    "static void %s(const double *p, double *y)\n{\n    %s_room r;\n    size_t first[%d];\n"
                    "    double middle[%d], weight[%d], value[%d], lanes[%d];\n",
                    name, name, groups, groups, 8 * groups, n, 4 * n);
    kmp_text_printf(
        text,
        "    const kmp_places s = {%d, %d, %s_candidates, &r, %s_exponent, %s_averaged, first, middle, weight, "
        "value, lanes};\n",
        places, n, name, name, name);
    put_preparation(text, b, name);
    kmp_text_put(text, "    kmp_places_run(&s, y);\n}\n\n");
}

/* Newton's method. */
static void put_solver(kmp_text *text, const struct kmp_code_block *b, const char *name)
{
    const kmp_program_block *block = b->block;
    const int n = block->unknowns, among = block->candidates > 0, f = b->part[KMP_PART_EQUATIONS].arrays[0].count;
    kmp_text_printf(text, "typedef struct %s_room {\n", name);
    put_kept(text, b);
    kmp_text_printf(text, ", f[%d];\n", f > n ? f : n);
    if (among)
        kmp_text_printf(text, "    double merits[%d];\n", block->candidates);
    kmp_text_printf(text, "} %s_room;\n\n", name);
    put_callbacks(text, b, name);
    kmp_text_printf(text,
                    "/* The unknowns for the arguments p; NAN without a solution. */\n"
                    "static void %s(const double *p, double *y)\n{\n    %s_room r;\n",
                    name, name);
    kmp_text_printf(text, "    kmp_newton s = {.unknowns = %d, .self = &r, .equations = %s_at, .guess = %s_begin};\n",
                    n, name, name);
    if (among)
        kmp_text_printf(text, "    s.candidates = %d;\n    s.candidate = %s_candidates;\n    s.merits = %s_merits;\n",
                        block->candidates, name, name);
    put_preparation(text, b, name);
    kmp_text_printf(text,
                    "    bool solved = kmp_newton_solve(&s);\n    for (int i = 0; i < %d; i++)\n"
                    "        y[i] = solved ? s.y[i] : (double)NAN;\n}\n\n",
                    n);
}

static void put_block(const kmp_code_writer *w, const struct kmp_code_block *b, int number)
{
    kmp_text name = {0};
    kmp_text_printf(&name, "%s_%s_block%d", w->source->name, w->routine->name, number);
    if (name.failed || !name.s) {
        w->text->failed = true;
        return;
    }
    if (b->block->candidates > 0) {
        kmp_text_printf(w->text, "static const double %s_candidates[] = ", name.s);
        kmp_put_numbers(w->text, w->language, &w->language->numbers, b->block->candidates, b->block->candidate);
        kmp_text_put(w->text, ";\n\n");
    }
    (b->block->averages ? put_average : put_solver)(w->text, b, name.s);
    kmp_text_free(&name);
}

/* -- files ------------------------------------------------------------------------------------------- */

/* An argument with its type; all of a function. */
#define TYPED      "$(if is time)double $(end)$(if not is time)const double *$(end)$(argument)"
#define PARAMETERS "$(each input)$(comma)" TYPED "$(end)$(each array), double *$(array)$(end)"

static const char header[] =
    "/*\n$(banner) */\n"
    "#ifndef KEMPE_$(name)_H\n#define KEMPE_$(name)_H\n\n"
    "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n"
    "enum { $(name)_coordinates = $(motions), $(name)_rows = $(rows), $(name)_parameters = $(parameters), "
    "$(name)_bodies = $(bodies) };\n\n"
    "extern const char $(name)_hash[17]; /* of the model */\n"
    "extern const char *const $(name)_coordinate_names[];\n"
    "$(if rows)extern const char *const $(name)_row_names[];\n$(end)"
    "$(if given)enum { $(name)_inputs = $(given) };\nextern const char *const $(name)_input_names[];\n$(end)"
    "$(if shown)enum { $(name)_shown = $(shown) };\nextern const char *const $(name)_output_names[];\n$(end)"
    "$(if frictions)enum { $(name)_frictions = $(frictions) };\nextern const char *const $(name)_friction_names[];\n"
    "extern const int $(name)_friction_rows[]; /* of h */\n"
    "extern const int $(name)_friction_modes[]; /* the first entry of each in modes */\n$(end)"
    "$(if contacts)enum { $(name)_contacts = $(contacts) };\nextern const char *const $(name)_contact_names[];\n"
    "extern const int $(name)_contact_rows[]; /* of h */\n"
    "extern const int $(name)_contact_modes[]; /* the first entry of each in modes */\n$(end)"
    "$(if elements)enum { $(name)_elements = $(elements), $(name)_mode_entries = $(mode entries) }; "
    "/* of modes */\n$(end)"
    "$(if discrete)enum { $(name)_discrete_states = $(discrete) };\nextern const char *const "
    "$(name)_discrete_names[];\n"
    "extern const int $(name)_discrete_places[]; /* in qd */\n"
    "extern const double $(name)_sample_times[]; /* s; INFINITY: it changes at events */\n$(end)"
    "$(if delays)enum { $(name)_delays = $(delays) };\nextern const char *const $(name)_delay_names[];\n"
    "extern const int $(name)_delay_places[]; /* in qd */\n"
    "extern const int $(name)_delay_given[]; /* 1: `before` has the signal; 0: it keeps its value at the start "
    "*/\n$(end)"
    "$(if parameters)extern const char *const $(name)_parameter_names[];\n"
    "extern const double $(name)_parameter_values[]; /* of the model */\n$(end)\n"
    "$(each routine)"
    "$(if prepared)enum { $(name)_$(routine)_k = $(kept or 1) };\n\n"
    "/** k[$(name)_$(routine)_k] from p[$(name)_parameters]: once, whenever p has changed. */\n"
    "void $(name)_$(routine)_prepare(const double *p, double *k);\n\n$(end)"
    "/* Matrices row by row, whole.\n$(about) */\n"
    "void $(name)_$(routine)(" PARAMETERS ");\n\n"
    "$(end)"
    "#ifdef __cplusplus\n}\n#endif\n#endif\n";

static const char body[] =
    "/*\n$(banner) *\n"
    " * To compile: cc -std=c99 -O2 -ffp-contract=off -c $(name).c (kempe_runtime.h beside it, libm to link). With\n"
    " * contraction, or with -ffast-math, the results differ from those of Kempe by rounding.\n */\n"
    "#include \"$(name).h\"\n#include \"kempe_runtime.h\"\n$(if solves)#include \"kempe_newton.h\"\n$(end)\n"
    "const char $(name)_hash[17] = \"$(hash)\";\n"
    "const char *const $(name)_coordinate_names[] = $(coordinate names);\n"
    "$(if rows)const char *const $(name)_row_names[] = $(row names);\n$(end)"
    "$(if given)const char *const $(name)_input_names[] = $(input names);\n$(end)"
    "$(if shown)const char *const $(name)_output_names[] = $(output names);\n$(end)"
    "$(if frictions)const char *const $(name)_friction_names[] = $(friction names);\n"
    "const int $(name)_friction_rows[] = $(friction rows);\n"
    "const int $(name)_friction_modes[] = $(friction modes);\n$(end)"
    "$(if contacts)const char *const $(name)_contact_names[] = $(contact names);\n"
    "const int $(name)_contact_rows[] = $(contact rows);\n"
    "const int $(name)_contact_modes[] = $(contact modes);\n$(end)"
    "$(if discrete)const char *const $(name)_discrete_names[] = $(discrete names);\n"
    "const int $(name)_discrete_places[] = $(discrete places);\n"
    "const double $(name)_sample_times[] = $(discrete times);\n$(end)"
    "$(if delays)const char *const $(name)_delay_names[] = $(delay names);\n"
    "const int $(name)_delay_places[] = $(delay places);\n"
    "const int $(name)_delay_given[] = $(delay given);\n$(end)"
    "$(if parameters)const char *const $(name)_parameter_names[] = $(parameter names);\n"
    "const double $(name)_parameter_values[] = $(values);\n$(end)\n"
    "$(functions)"
    "$(each shared table)"
    "static const double $(name)_x$(shared table)[$(points)] = $(x);\n"
    "static const double $(name)_y$(shared table)[$(points)] = $(y);\n"
    "static const double $(name)_c$(shared table)[$(polynomials)][4] = $(pieces);\n\n$(end)"
    "$(each routine)"
    "$(blocks)$(prepare)$(function)$(end)";

#define UNUSED "    (void)$(argument);\n$(end)"
#define ROOM   "$(if slots)    double w[$(slots)];\n$(end)"

const kmp_language kmp_language_c = {
    .name = "c",
    .title = "C",
    .chunk = CHUNK,
    .infinity = "(double)INFINITY",
    .nan = "(double)NAN",
    .quote = '"',
    .escape = '\\',
    .escaped = "\"\\?", /* three characters from ?? on may mean another one: a trigraph */
    .names = {"{\n    ", "}", ", ", ",\n    ", 8},
    .numbers = {"{\n    ", "}", ", ", ",\n    ", 6},
    .pieces = {"{", "}", ", ", NULL, 0},
    .piece = {"{\n    ", "}", ", ", NULL, 0},
    .open = '[',
    .close = ']',
    .flat = true,
    .chains = true,
    .local = "const double ",
    .end = ";",
    .pair = "    double $(sine), $(cosine);\n    kempe_sincos($(angle), &$(sine), &$(cosine));\n",
    .comment = "/*",
    .comment_end = " */",
    .mark = " *",
    .routine_mark = " *",
    .table_call = "kempe_interpolate($(points), $(name)_x$(shared table), $(name)_y$(shared table), "
                  "$(name)_c$(shared table), $(derivative), ",
    .call = call,
    .define = define,
    .block = put_block,
    .solve = "    double $(what)[$(count)];\n"
             "    $(name)_$(routine)_block$(number)((const double[]){$(argument)}, $(what));\n",
    .newton = KMP_RUNTIME_NEWTON,
    .prepare = "$(static)void $(name)_$(routine)_prepare(const double *p, double *k)\n{\n" ROOM
               "$(each unread parameter)" UNUSED "$(statements)}\n\n",
    .function = "$(static)void $(name)_$(routine)(" PARAMETERS ")\n{\n" ROOM "$(each empty array)" UNUSED
                "$(each unread input)" UNUSED
                "$(each array)$(if has zeros)    memset($(array), 0, $(entries) * sizeof(double));\n$(end)$(end)"
                "$(statements)}\n\n",
    .part =
        "static void $(name)_$(routine)$(_prepare)_$(part)("
        "$(if _prepare)const double *p, double *k$(end)$(if not _prepare)$(each read input)$(comma)" TYPED
        "$(end)$(end)$(if slots used)$(comma)double *w$(end)$(each written array)$(comma)double *$(array)$(end))\n{\n"
        "$(if _prepare)$(each unread parameter)" UNUSED "$(end)$(statements)}\n\n",
    .part_call = "    $(name)_$(routine)$(_prepare)_$(part)("
                 "$(if _prepare)p, k$(end)$(if not _prepare)$(each read input)$(comma)$(argument)$(end)$(end)"
                 "$(if slots used)$(comma)w$(end)$(each written array)$(comma)$(array)$(end));\n",
    .pages = {{"$(name).h", header},
              {"$(name).c", body},
              {"kempe_runtime.h", "$(runtime)"},
              {"$(if solves)kempe_newton.h$(end)", "$(newton)"}}};
