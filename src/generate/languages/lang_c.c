/* SPDX-License-Identifier: BSD-3-Clause */
/* C99: NAME.h and NAME.c, which needs libm and kempe_runtime.h in the same folder. Compiled without contraction it
 * computes the bits of the tape. A long routine is a sequence of functions of CHUNK statements. Compile time grows
 * faster than length (gcc -O1, 84 000 operations: 4.6 s by 250, 6.2 s by 1000). Calls are as fast. Values that several
 * functions read are in an array of their caller. */
#include "base/memory.h"
#include "generate/banner.h"
#include "generate/languages/runtime_lines.h"
#include "generate/scalar.h"
#include "symbolic/table.h"
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

static const char *const operands[4] = {"", "x", "x, y", "x, y, z"};

static bool says(kmp_op op)
{
    return op != KMP_OP_IMPLICIT && op != KMP_OP_LIST;
}

/* True if the operation is a function of libm: its value is a call. */
static bool is_in_libm(kmp_op op)
{
    const char *arguments = operands[kmp_op_arity(op)], *value = values[op], *name = kmp_op_text(op);
    size_t length = name ? strlen(name) : 0;
    return value && length > 0 && strncmp(value, name, length) == 0 && value[length] == '(' &&
           strncmp(value + length + 1, arguments, strlen(arguments)) == 0 &&
           strcmp(value + length + 1 + strlen(arguments), ")") == 0;
}

static void put_function(kmp_text *text, const kmp_code_source *source, kmp_op op)
{
    if (!is_in_libm(op))
        kmp_text_printf(text, "%s_", source->name);
    kmp_text_put(text, kmp_op_text(op));
}

static void put_table(kmp_text *text, const kmp_code_source *source, const kmp_routine *r, int table, int derivative)
{
    kmp_text_printf(text, "kempe_table(%d, %s_%s_x%d, %s_%s_y%d, %s_%s_c%d, %d, ", r->program->table[table]->count,
                    source->name, r->name, table, source->name, r->name, table, source->name, r->name, table,
                    derivative);
}

/* Sine and cosine at once; a local variable for each that is not needed or has a slot. */
static void put_pair(kmp_scalar *s, kmp_text *text, const kmp_statement *st)
{
    bool sine = s->p->instruction[st->value].op == KMP_OP_SIN;
    int set[2] = {sine ? st->value : st->partner, sine ? st->partner : st->value};
    kmp_text_put(text, "    double ");
    for (int k = 0; k < 2; k++) {
        kmp_text_put(text, k ? ", " : "");
        if (set[k] < 0 || s->slot[set[k]])
            kmp_text_printf(text, "%c%d", k ? 'c' : 's', s->variable[st->value]);
        else
            kmp_scalar_variable(s, text, set[k]);
    }
    kmp_text_put(text, ";\n    kempe_sincos(");
    kmp_scalar_operand(s, text, s->p->instruction[st->value].a);
    for (int k = 0; k < 2; k++) {
        kmp_text_put(text, ", &");
        if (set[k] < 0 || s->slot[set[k]])
            kmp_text_printf(text, "%c%d", k ? 'c' : 's', s->variable[st->value]);
        else
            kmp_scalar_variable(s, text, set[k]);
    }
    kmp_text_put(text, ");\n");
    for (int k = 0; k < 2; k++)
        if (set[k] >= 0 && s->slot[set[k]]) {
            kmp_text_put(text, "    ");
            kmp_scalar_variable(s, text, set[k]);
            kmp_text_printf(text, " = %c%d;\n", k ? 'c' : 's', s->variable[st->value]);
        }
}

static const kmp_tongue tongue = {.open = '[',
                                  .close = ']',
                                  .infinity = "(double)INFINITY",
                                  .nan = "(double)NAN",
                                  .comment = "/*",
                                  .comment_end = " */",
                                  .local = "const double ",
                                  .end = ";",
                                  .flat = true,
                                  .chains = true,
                                  .function = put_function,
                                  .table = put_table,
                                  .pair = put_pair};

static void define_function(kmp_text *text, const kmp_code_source *source, kmp_op op)
{
    static const char *const parameters[4] = {"void", "double x", "double x, double y", "double x, double y, double z"};
    kmp_text_printf(text, "static double %s_%s(%s)\n{\n    return %s;\n}\n\n", source->name, kmp_op_text(op),
                    parameters[kmp_op_arity(op)], values[op]);
}

static void define_functions(kmp_text *text, const kmp_code_source *source)
{
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        bool used = false;
        if (kmp_op_form_of((kmp_op)op) != KMP_FORM_FUNCTION || op == KMP_OP_SIN || op == KMP_OP_COS ||
            is_in_libm((kmp_op)op))
            continue;
        for (int k = 0; k < source->count; k++) {
            const kmp_program *p = source->routines[k].program;
            for (int i = 0; i < p->code[p->stages]; i++)
                used = used || p->instruction[i].op == op;
        }
        if (used)
            define_function(text, source, (kmp_op)op);
    }
}

/* -- tables ------------------------------------------------------------------------------------------ */

static void put_numbers(kmp_text *text, int count, const double *x)
{
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? k % 6 ? ", " : ",\n    " : "{\n    ");
        kmp_scalar_number(text, &tongue, x[k]);
    }
    kmp_text_put(text, "}");
}

static void define_table(kmp_text *text, const char *name, const char *routine, int number, const kmp_table *t)
{
    kmp_text_printf(text, "static const double %s_%s_x%d[%d] = ", name, routine, number, t->count);
    put_numbers(text, t->count, t->x);
    kmp_text_printf(text, ";\nstatic const double %s_%s_y%d[%d] = ", name, routine, number, t->count);
    put_numbers(text, t->count, t->y);
    kmp_text_printf(text, ";\nstatic const double %s_%s_c%d[%d][4] = {", name, routine, number, t->count - 1);
    for (int k = 0; k < t->count - 1; k++) {
        kmp_text_put(text, k ? ", " : "");
        put_numbers(text, 4, t->piece[k]);
    }
    kmp_text_put(text, "};\n\n");
}

/* -- declarations ------------------------------------------------------------------------------------ */

/* Parameters that a function has: those kinds of input, w, and the arrays. */
static void put_parameters(kmp_text *text, const kmp_routine *r, unsigned kinds, bool slots, unsigned arrays,
                           bool types)
{
    const char *comma = "";
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (kinds & 1u << kind) {
            const char *type = !types ? "" : kind == KMP_IN_TIME ? "double " : "const double *";
            kmp_text_printf(text, "%s%s%s", comma, type, kmp_argument_names[kind]);
            comma = ", ";
        }
    if (slots) {
        kmp_text_printf(text, "%s%sw", comma, types ? "double *" : "");
        comma = ", ";
    }
    for (int a = 0; a < r->array_count; a++)
        if (arrays & 1u << a) {
            kmp_text_printf(text, "%s%s%s", comma, types ? "double *" : "", r->arrays[a].name);
            comma = ", ";
        }
}

static unsigned public_kinds(const kmp_code_source *source, const kmp_routine *r)
{
    return r->arguments | (source->parameters ? 1u << KMP_IN_PARAMETER : 0);
}

static void put_public(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    kmp_text_printf(text, "void %s_%s(", source->name, r->name);
    put_parameters(text, r, public_kinds(source, r), false, ~0u, true);
    kmp_text_put(text, ")");
}

static void declare_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *r)
{
    if (source->parameters)
        kmp_text_printf(text,
                        "enum { %s_%s_k = %d };\n\n/** k[%s_%s_k] from p[%s_parameters]: once, whenever p has "
                        "changed. */\nvoid %s_%s_prepare(const double *p, double *k);\n\n",
                        source->name, r->name, r->kept_count ? r->kept_count : 1, source->name, r->name, source->name,
                        source->name, r->name);
    kmp_text_put(text, "/* Matrices row by row, whole.\n");
    kmp_banner_routine(text, source, r, " *");
    kmp_text_put(text, " */\n");
    put_public(text, source, r);
    kmp_text_put(text, ";\n\n");
}

static void write_header(kmp_text *text, const kmp_code_source *source)
{
    const char *name = source->name;
    kmp_text_put(text, "/*\n");
    kmp_banner_put(text, source, " *", 0);
    kmp_text_put(text, " */\n");
    kmp_text_printf(text, "#ifndef KEMPE_%s_H\n#define KEMPE_%s_H\n\n", name, name);
    kmp_text_put(text, "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n");
    kmp_text_printf(text, "enum { %s_coordinates = %d, %s_rows = %d, %s_parameters = %d, %s_bodies = %d };\n\n", name,
                    source->n, name, source->m, name, source->parameter_count, name, source->body_count);
    kmp_text_printf(text, "extern const char %s_hash[17]; /* of the model */\n", name);
    kmp_text_printf(text, "extern const char *const %s_coordinate_names[];\n", name);
    if (source->m)
        kmp_text_printf(text, "extern const char *const %s_row_names[];\n", name);
    if (source->parameter_count)
        kmp_text_printf(text,
                        "extern const char *const %s_parameter_names[];\n"
                        "extern const double %s_parameter_values[]; /* of the model */\n",
                        name, name);
    kmp_text_put(text, "\n");
    for (int k = 0; k < source->count; k++)
        declare_routine(text, source, &source->routines[k]);
    kmp_text_put(text, "#ifdef __cplusplus\n}\n#endif\n#endif\n");
}

/* -- definitions ------------------------------------------------------------------------------------- */

static void define_names(kmp_text *text, const char *name, const char *what, int count, const char *const *names)
{
    kmp_text_printf(text, "const char *const %s_%s_names[] = {", name, what);
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? k % 8 ? ", " : ",\n    " : "\n    ");
        kmp_banner_quote(text, names[k]);
    }
    kmp_text_put(text, "};\n");
}

static bool define_data(kmp_text *text, const kmp_code_source *source)
{
    const char **names = KMP_NEW(const char *, source->n);
    if (!names)
        return false;
    for (int k = 0; k < source->n; k++)
        names[k] = source->model->motions[k].name;
    kmp_text_printf(text, "const char %s_hash[17] = \"%s\";\n", source->name, source->hash);
    define_names(text, source->name, "coordinate", source->n, names);
    kmp_free(names);
    if (source->m)
        define_names(text, source->name, "row", source->m, (const char *const *)source->row_names);
    if (source->parameter_count) {
        define_names(text, source->name, "parameter", source->parameter_count,
                     (const char *const *)source->parameter_name);
        kmp_text_printf(text, "const double %s_parameter_values[] = ", source->name);
        put_numbers(text, source->parameter_count, source->value);
        kmp_text_put(text, ";\n");
    }
    kmp_text_put(text, "\n");
    return true;
}

static void ignore_unused(kmp_text *text, const kmp_routine *r, unsigned kinds)
{
    for (int a = 0; a < r->array_count; a++)
        if (r->arrays[a].count == 0)
            kmp_text_printf(text, "    (void)%s;\n", r->arrays[a].name);
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (kinds & 1u << kind)
            kmp_text_printf(text, "    (void)%s;\n", kmp_argument_names[kind]);
}

/* Outputs begin with zeros where some entry is one. */
static void put_zeros(const kmp_scalar *s, kmp_text *text)
{
    for (int a = 0; s->stage > 0 && a < s->routine->array_count; a++) {
        const kmp_array *array = &s->routine->arrays[a];
        if (kmp_scalar_has_zeros(s, a))
            kmp_text_printf(text, "    memset(%s, 0, %d * sizeof(double));\n", array->name,
                            array->rows * (array->cols ? array->cols : 1));
    }
}

static void put_head(kmp_scalar *s, kmp_text *text)
{
    if (s->stage > 0)
        put_public(text, s->source, s->routine);
    else
        kmp_text_printf(text, "void %s_%s_prepare(const double *p, double *k)", s->source->name, s->routine->name);
    kmp_text_put(text, "\n{\n");
}

/* In stage 0 chunks read p and write k: both are always theirs. */
static void put_chunk_parameters(kmp_scalar *s, kmp_text *text, unsigned kinds, bool slots, unsigned arrays, bool types)
{
    if (s->stage > 0) {
        put_parameters(text, s->routine, kinds, slots, arrays, types);
        return;
    }
    kmp_text_put(text, types ? "const double *p, double *k" : "p, k");
    if (slots)
        kmp_text_put(text, types ? ", double *w" : ", w");
}

/* A function for each chunk, then the one that calls them. */
static void define_chunks(kmp_scalar *s, kmp_text *text)
{
    kmp_text calls = {0};
    unsigned all = 0;
    for (int chunk = 0, at = 0; chunk < s->chunks; chunk++) {
        kmp_text body = {0};
        unsigned arrays = kmp_scalar_chunk(s, &body, chunk, &at);
        all |= s->used;
        const char *prepare = s->stage > 0 ? "" : "_prepare";
        kmp_text_printf(text, "static void %s_%s%s_%d(", s->source->name, s->routine->name, prepare, chunk + 1);
        put_chunk_parameters(s, text, s->used, s->slots_used, arrays, true);
        kmp_text_printf(text, ")\n{\n%s%s}\n\n", s->stage > 0 ? "" : "    (void)p;\n    (void)k;\n",
                        body.s ? body.s : "");
        kmp_text_printf(&calls, "    %s_%s%s_%d(", s->source->name, s->routine->name, prepare, chunk + 1);
        put_chunk_parameters(s, &calls, s->used, s->slots_used, arrays, false);
        kmp_text_put(&calls, ");\n");
        text->failed = text->failed || body.failed;
        kmp_text_free(&body);
    }
    put_head(s, text);
    if (s->slots)
        kmp_text_printf(text, "    double w[%d];\n", s->slots);
    if (s->stage > 0)
        ignore_unused(text, s->routine, public_kinds(s->source, s->routine) & ~all);
    put_zeros(s, text);
    kmp_text_put(text, calls.s ? calls.s : "");
    kmp_text_put(text, "}\n\n");
    text->failed = text->failed || calls.failed;
    kmp_text_free(&calls);
}

static void define_whole(kmp_scalar *s, kmp_text *text)
{
    kmp_text body = {0};
    int at = 0;
    (void)kmp_scalar_chunk(s, &body, 0, &at);
    put_head(s, text);
    if (s->stage > 0)
        ignore_unused(text, s->routine, public_kinds(s->source, s->routine) & ~s->used);
    else
        kmp_text_put(text, s->sink_count ? "" : "    (void)p;\n    (void)k;\n");
    put_zeros(s, text);
    kmp_text_put(text, body.s ? body.s : "");
    kmp_text_put(text, "}\n\n");
    text->failed = text->failed || body.failed;
    kmp_text_free(&body);
}

static bool define_stage(kmp_text *text, const kmp_code_source *source, const kmp_routine *r, int stage)
{
    kmp_scalar s;
    if (!kmp_scalar_init(&s, source, r, stage, &tongue, CHUNK))
        return false;
    if (s.chunks > 1)
        define_chunks(&s, text);
    else
        define_whole(&s, text);
    kmp_scalar_free(&s);
    return true;
}

static bool write_body(kmp_text *text, const kmp_code_source *source)
{
    kmp_text_put(text, "/*\n");
    kmp_banner_put(text, source, " *", 0);
    kmp_text_printf(text,
                    " *\n * To compile: cc -std=c99 -O2 -ffp-contract=off -c %s.c (kempe_runtime.h beside it, libm to "
                    "link). With\n * contraction, or with -ffast-math, the results differ from those of Kempe by "
                    "rounding.\n */\n",
                    source->name);
    kmp_text_printf(text, "#include \"%s.h\"\n#include \"kempe_runtime.h\"\n\n", source->name);
    bool ok = define_data(text, source);
    define_functions(text, source);
    for (int k = 0; k < source->count && ok; k++) {
        const kmp_routine *r = &source->routines[k];
        for (int t = 0; t < r->program->table_count; t++)
            define_table(text, source->name, r->name, t, r->program->table[t]);
        ok = (!source->parameters || define_stage(text, source, r, 0)) && define_stage(text, source, r, 1);
    }
    return ok;
}

static bool write_files(const kmp_code_source *source, kmp_code_files *files)
{
    kmp_text *header = kmp_code_add(files, source->name, ".h");
    if (!header)
        return false;
    write_header(header, source);
    kmp_text *body = kmp_code_add(files, source->name, ".c");
    if (!body || !write_body(body, source))
        return false;
    kmp_text *runtime = kmp_code_add(files, "kempe_runtime", ".h");
    for (int k = 0; runtime && kmp_runtime_lines[k]; k++)
        kmp_text_put(runtime, kmp_runtime_lines[k]);
    return runtime;
}

const kmp_language kmp_language_c = {.name = "c", .vectorises = false, .says = says, .write = write_files};
