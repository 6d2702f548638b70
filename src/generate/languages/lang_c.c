/* SPDX-License-Identifier: BSD-3-Clause */
/* C99: NAME.h and NAME.c, which needs libm and kempe_runtime.h in the same folder. Compiled without contraction it
 * computes the bits of the tape. A long routine is a sequence of functions of CHUNK statements. Compile time grows
 * faster than length (gcc -O1, 84 000 operations: 4.6 s by 250, 6.2 s by 1000). Calls are as fast. Values that several
 * functions read are in an array of their caller. */
#include "generate/languages/language.h"
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

static void call(const kmp_writer *w, kmp_op op)
{
    if (!is_in_libm(op))
        kmp_text_printf(w->text, "%s_", w->source->name);
    kmp_text_put(w->text, kmp_op_text(op));
}

static void define(const kmp_writer *w, kmp_op op)
{
    static const char *const parameters[4] = {"void", "double x", "double x, double y", "double x, double y, double z"};
    if (kmp_op_form_of(op) == KMP_FORM_FUNCTION && op != KMP_OP_SIN && op != KMP_OP_COS && !is_in_libm(op))
        kmp_text_printf(w->text, "static double %s_%s(%s)\n{\n    return %s;\n}\n\n", w->source->name, kmp_op_text(op),
                        parameters[kmp_op_arity(op)], values[op]);
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
    "#include \"$(name).h\"\n#include \"kempe_runtime.h\"\n\n"
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
    "$(each routine)"
    "$(each table)"
    "static const double $(name)_$(routine)_x$(table)[$(points)] = $(x);\n"
    "static const double $(name)_$(routine)_y$(table)[$(points)] = $(y);\n"
    "static const double $(name)_$(routine)_c$(table)[$(polynomials)][4] = $(pieces);\n\n$(end)"
    "$(prepare)$(function)$(end)";

#define UNUSED "    (void)$(argument);\n$(end)"
#define ROOM   "$(if slots)    double w[$(slots)];\n$(end)"

const kmp_language kmp_language_c = {
    .name = "c",
    .chunk = CHUNK,
    .infinity = "(double)INFINITY",
    .nan = "(double)NAN",
    .quote = '"',
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
    .table_call = "kempe_interpolate($(points), $(name)_$(routine)_x$(table), $(name)_$(routine)_y$(table), "
                  "$(name)_$(routine)_c$(table), $(derivative), ",
    .call = call,
    .define = define,
    .prepare = "void $(name)_$(routine)_prepare(const double *p, double *k)\n{\n" ROOM "$(each unread parameter)" UNUSED
               "$(statements)}\n\n",
    .function =
        "void $(name)_$(routine)(" PARAMETERS ")\n{\n" ROOM "$(each empty array)" UNUSED "$(each unread input)" UNUSED
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
    .pages = {{"$(name).h", header}, {"$(name).c", body}, {"kempe_runtime.h", "$(runtime)"}}};
