/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes the files of any language: fills in its templates. */
#include "generate/banner.h"
#include "generate/languages/language.h"
#include "generate/languages/levels.h"
#include "generate/languages/runtime_lines.h"
#include "generate/scalar.h"
#include "symbolic/table.h"
#include <math.h>
#include <string.h>

/* -- lists ------------------------------------------------------------------------------------------- */

void kmp_list_item(kmp_text *text, const kmp_list_spelling *list, int k)
{
    kmp_text_put(text, k == 0 ? list->open : list->a_line && k % list->a_line == 0 ? list->broken : list->between);
}

void kmp_list_end(kmp_text *text, const kmp_list_spelling *list, int count)
{
    kmp_text_put(text, count ? "" : list->open);
    kmp_text_put(text, list->close);
}

void kmp_language_number(kmp_text *text, const kmp_language *language, double x)
{
    size_t before = text->length;
    if (!isfinite(x)) {
        kmp_text_put(text, isnan(x) ? language->nan : x < 0 ? "-" : "");
        kmp_text_put(text, isnan(x) ? "" : language->infinity);
        return;
    }
    kmp_text_number(text, x);
    if (!text->failed && !strpbrk(text->s + before, ".e"))
        kmp_text_put(text, ".0");
}

static void put_numbers(const kmp_writer *w, const kmp_list_spelling *list, int count, const double *x)
{
    for (int k = 0; k < count; k++) {
        kmp_list_item(w->text, list, k);
        kmp_language_number(w->text, w->language, x[k]);
    }
    kmp_list_end(w->text, list, count);
}

/* In double quotes a quote and a backslash get a backslash, in single ones a quote is doubled. */
static void put_string(const kmp_writer *w, const char *s)
{
    char quote = w->language->quote;
    kmp_text_printf(w->text, "%c", quote);
    for (; *s; s++) {
        if (*s == quote || (quote == '"' && *s == '\\'))
            kmp_text_printf(w->text, "%c", quote == '"' ? '\\' : quote);
        kmp_text_printf(w->text, "%c", (unsigned char)*s < 0x20 ? ' ' : *s);
    }
    kmp_text_printf(w->text, "%c", quote);
}

/* names NULL: of the coordinates */
static void put_names(const kmp_writer *w, int count, char *const *names)
{
    for (int k = 0; k < count; k++) {
        kmp_list_item(w->text, &w->language->names, k);
        put_string(w, names ? names[k] : w->source->model->motions[k].name);
    }
    kmp_list_end(w->text, &w->language->names, count);
}

static void put_coordinates(const kmp_writer *w)
{
    put_names(w, w->source->n, NULL);
}

static void put_rows(const kmp_writer *w)
{
    put_names(w, w->source->m, w->source->row_names);
}

static void put_parameters(const kmp_writer *w)
{
    put_names(w, w->source->parameter_count, w->source->parameter_name);
}

static void put_values(const kmp_writer *w)
{
    put_numbers(w, &w->language->numbers, w->source->parameter_count, w->source->value);
}

static void put_constants(const kmp_writer *w)
{
    put_numbers(w, &w->language->numbers, w->levels->number_count, w->levels->numbers);
}

/* -- tables ------------------------------------------------------------------------------------------ */

static const kmp_table *table_of(const kmp_writer *w)
{
    return w->routine->program->table[w->table];
}

static void put_abscissas(const kmp_writer *w)
{
    put_numbers(w, &w->language->numbers, table_of(w)->count, table_of(w)->x);
}

static void put_ordinates(const kmp_writer *w)
{
    put_numbers(w, &w->language->numbers, table_of(w)->count, table_of(w)->y);
}

static void put_pieces(const kmp_writer *w)
{
    const kmp_table *table = table_of(w);
    for (int k = 0; k < table->count - 1; k++) {
        kmp_list_item(w->text, &w->language->pieces, k);
        put_numbers(w, &w->language->piece, 4, table->piece[k]);
    }
    kmp_list_end(w->text, &w->language->pieces, table->count - 1);
}

static void put_tables(const kmp_writer *w)
{
    kmp_writer one = *w;
    for (one.table = 0; one.table < w->routine->program->table_count; one.table++)
        kmp_fill(&one, w->language->table);
}

/* -- functions --------------------------------------------------------------------------------------- */

bool kmp_language_has(const kmp_language *language, kmp_op op)
{
    return !language->functions || kmp_op_form_of(op) != KMP_FORM_FUNCTION || language->functions[op].call;
}

static bool is_used_in(const kmp_program *p, kmp_op op)
{
    for (int i = 0; i < p->code[p->stages]; i++)
        if (p->instruction[i].op == op)
            return true;
    return false;
}

static bool is_used(const kmp_writer *w, kmp_op op)
{
    bool used = w->routine && is_used_in(w->routine->program, op);
    for (int k = 0; !w->routine && !used && k < w->source->count; k++)
        used = is_used_in(w->source->routines[k].program, op);
    return used;
}

/* Definitions of the functions that the routine needs, or all routines. */
static void put_functions(const kmp_writer *w)
{
    const kmp_function_spelling *functions = w->language->functions;
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        if (!is_used(w, (kmp_op)op))
            continue;
        if (w->language->define)
            w->language->define(w, (kmp_op)op);
        else if (w->source->vectorised && functions[op].of_arrays)
            kmp_fill(w, functions[op].of_arrays);
        else if (functions[op].definition)
            kmp_fill(w, functions[op].definition);
    }
}

/* -- arguments --------------------------------------------------------------------------------------- */

static unsigned kinds_of(const kmp_writer *w)
{
    return w->routine->arguments | (w->source->parameters ? 1u << KMP_IN_PARAMETER : 0);
}

static void put_argument(const kmp_writer *w, const char **comma, const char *type, const char *name)
{
    kmp_text_printf(w->text, "%s%s%s", *comma, type ? type : "", name);
    *comma = ", ";
}

static void put_inputs(const kmp_writer *w, const char **comma, unsigned kinds, bool typed)
{
    const kmp_language *l = w->language;
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (kinds & 1u << kind)
            put_argument(w, comma,
                         !typed                ? NULL
                         : kind == KMP_IN_TIME ? l->number
                                               : l->input,
                         kmp_argument_names[kind]);
}

static void put_arrays(const kmp_writer *w, const char **comma, unsigned arrays, const char *type)
{
    for (int a = 0; a < w->routine->array_count; a++)
        if (arrays & 1u << a)
            put_argument(w, comma, type, w->routine->arrays[a].name);
}

static void put_arguments(const kmp_writer *w)
{
    const char *comma = "";
    put_inputs(w, &comma, kinds_of(w), true);
    put_arrays(w, &comma, w->language->output ? ~0u : 0, w->language->output);
}

static void put_results(const kmp_writer *w)
{
    const char *comma = "";
    put_arrays(w, &comma, ~0u, NULL);
}

/* What a part of a split function reads and writes: of the parameters always p and k. */
static void put_part_arguments(const kmp_writer *w, bool typed)
{
    const char *comma = "", *output = typed ? w->language->output : NULL;
    if (w->scalar->stage == 0) {
        put_argument(w, &comma, typed ? w->language->input : NULL, "p");
        put_argument(w, &comma, output, "k");
    } else {
        put_inputs(w, &comma, w->used, typed);
    }
    if (w->scalar->slots_used)
        put_argument(w, &comma, output, "w");
    if (w->scalar->stage > 0)
        put_arrays(w, &comma, w->arrays, output);
}

static void put_part_parameters(const kmp_writer *w)
{
    put_part_arguments(w, true);
}

static void put_part_values(const kmp_writer *w)
{
    put_part_arguments(w, false);
}

static void put_for_argument(const kmp_writer *w, const char *pattern, const char *argument)
{
    kmp_writer one = *w;
    one.argument = argument;
    kmp_fill(&one, pattern);
}

static void put_unused(const kmp_writer *w)
{
    const kmp_scalar *s = w->scalar;
    if (s->stage == 0 && (w->part > 0 || (s->chunks == 1 && s->sink_count == 0))) {
        put_for_argument(w, w->language->unused, "p");
        put_for_argument(w, w->language->unused, "k");
    }
    if (s->stage == 0 || w->part > 0)
        return;
    for (int a = 0; a < w->routine->array_count; a++)
        if (w->routine->arrays[a].count == 0)
            put_for_argument(w, w->language->unused, w->routine->arrays[a].name);
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (kinds_of(w) & ~w->used & 1u << kind)
            put_for_argument(w, w->language->unused, kmp_argument_names[kind]);
}

static void put_conversions(const kmp_writer *w)
{
    for (int kind = KMP_IN_Q; kind < KMP_IN_COUNT; kind++)
        if (w->used & 1u << kind)
            put_for_argument(w, w->language->convert, kmp_argument_names[kind]);
}

/* Results begin with zeros; those of the caller only where some entry is one. */
static void put_zeros(const kmp_writer *w)
{
    kmp_writer one = *w;
    for (int a = 0; a < w->routine->array_count; a++) {
        one.array = &w->routine->arrays[a];
        if (!w->language->output || kmp_scalar_has_zeros(w->scalar, a))
            kmp_fill(&one, one.array->cols ? w->language->matrix : w->language->vector);
    }
}

/* -- routines ---------------------------------------------------------------------------------------- */

/* The statements of a stage: all of them, or a function for each chunk before, and its calls. */
static void write_statements(kmp_writer *w, kmp_scalar *s, kmp_text *statements)
{
    unsigned used = 0;
    for (int chunk = 0, at = 0; chunk < s->chunks; chunk++) {
        kmp_text own = {0};
        bool split = s->chunks > 1;
        kmp_writer part = *w, call = *w;
        part.arrays = kmp_scalar_chunk(s, split ? &own : statements, chunk, &at);
        part.used = s->used;
        part.part = chunk + 1;
        part.statements = &own;
        used |= s->used;
        call = part;
        call.text = statements;
        if (split) {
            kmp_fill(&part, w->language->part);
            kmp_fill(&call, w->language->part_call);
        }
        w->text->failed = w->text->failed || own.failed;
        kmp_text_free(&own);
    }
    w->used = used;
}

static void write_stage(const kmp_writer *w, int stage, const char *pattern)
{
    kmp_scalar s;
    kmp_text statements = {0};
    kmp_writer in = *w;
    if (!kmp_scalar_init(&s, w->source, w->routine, stage, w->language)) {
        w->text->failed = true;
        return;
    }
    in.scalar = &s;
    in.statements = &statements;
    write_statements(&in, &s, &statements);
    kmp_fill(&in, pattern);
    w->text->failed = w->text->failed || statements.failed;
    kmp_text_free(&statements);
    kmp_scalar_free(&s);
}

static void put_prepare(const kmp_writer *w)
{
    if (w->source->parameters)
        write_stage(w, 0, w->language->prepare);
}

static void put_function(const kmp_writer *w)
{
    kmp_nesting_levels levels;
    kmp_writer in = *w;
    if (!w->source->vectorised) {
        write_stage(w, 1, w->language->function);
    } else if (kmp_levels_init(&levels, w->source, w->routine)) {
        in.levels = &levels;
        kmp_fill(&in, w->language->arrays.function);
        kmp_levels_free(&levels);
    } else {
        w->text->failed = true;
    }
}

static void put_statements(const kmp_writer *w)
{
    kmp_text_put(w->text, w->statements->s ? w->statements->s : "");
}

static void put_banner(const kmp_writer *w)
{
    kmp_banner_put(w->text, w->source, w->language->mark, w->language->base);
}

static void put_about(const kmp_writer *w)
{
    kmp_banner_routine(w->text, w->source, w->routine, w->language->routine_mark);
}

static void put_runtime(const kmp_writer *w)
{
    for (int k = 0; kmp_runtime_lines[k]; k++)
        kmp_text_put(w->text, kmp_runtime_lines[k]);
}

/* -- words ------------------------------------------------------------------------------------------- */

static bool is(const char *word, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(word, name, length) == 0;
}

/* Words that stand for a text of their own. */
static const struct {
    const char *word;
    void (*put)(const kmp_writer *w);
} texts[] = {{"banner", put_banner},           /* comment on the file */
             {"about", put_about},             /* comment on the routine */
             {"coordinates", put_coordinates}, /* lists of names */
             {"row names", put_rows},
             {"parameter names", put_parameters},
             {"values", put_values},       /* of the parameters */
             {"runtime", put_runtime},     /* kempe/runtime.h */
             {"functions", put_functions}, /* definitions */
             {"tables", put_tables},
             {"x", put_abscissas}, /* of a table */
             {"y", put_ordinates},
             {"pieces", put_pieces},
             {"prepare", put_prepare}, /* functions of the routine */
             {"function", put_function},
             {"arguments", put_arguments},
             {"results", put_results},
             {"conversions", put_conversions}, /* of arguments that are read */
             {"unused", put_unused},           /* statements for arguments that are not */
             {"zeros", put_zeros},             /* arrays of zeros */
             {"statements", put_statements},
             {"part parameters", put_part_parameters}, /* of a part of a split function */
             {"part arguments", put_part_values},
             {"constants", put_constants},      /* of the vectorised form: numbers at v's beginning */
             {"lists", kmp_vectorised_lists},   /* named lists of places and signs */
             {"load", kmp_vectorised_load},     /* arguments into v */
             {"groups", kmp_vectorised_groups}, /* all operations */
             {"operands", kmp_vectorised_operands},
             {"scatter", kmp_vectorised_results}, /* v into the results */
             {"places", kmp_vectorised_places},   /* the items of a list */
             {"signs", kmp_vectorised_signs}};

/* Words that stand for a name or a number; those of another context are empty or 0. */
static void put_value(const kmp_writer *w, const char *word, size_t length)
{
    static const kmp_routine no_routine;
    static const kmp_array no_array;
    static const kmp_nesting_levels no_levels;
    const kmp_routine *r = w->routine ? w->routine : &no_routine;
    const kmp_array *a = w->array ? w->array : &no_array;
    const kmp_nesting_levels *l = w->levels ? w->levels : &no_levels;
    const kmp_code_source *source = w->source;
    bool has_table = r->program && w->table < r->program->table_count;
    const struct {
        const char *word, *text;
        long value;
    } values[] = {{"name", source->name, 0},
                  {"hash", source->hash, 0},
                  {"routine", r->name, 0},
                  {"argument", w->argument, 0},
                  {"array", a->name, 0},
                  {"angle", w->angle, 0},
                  {"sine", w->sine, 0},
                  {"cosine", w->cosine, 0},
                  {"what", w->what, 0},
                  {"_prepare", w->scalar && w->scalar->stage == 0 ? "_prepare" : "", 0},
                  {"motions", NULL, source->n},
                  {"rows", NULL, source->m},
                  {"parameters", NULL, source->parameter_count},
                  {"bodies", NULL, source->body_count},
                  {"prepared", NULL, source->parameters},
                  {"kept", NULL, r->kept_count},
                  {"kept or 1", NULL, r->kept_count ? r->kept_count : 1},
                  {"paper", NULL, r->tally.counts.paper},
                  {"robotran", NULL, r->tally.counts.robotran},
                  {"once", NULL, r->tally.counts.robotran - r->tally.runtime.robotran},
                  {"height", NULL, a->rows},
                  {"width", NULL, a->cols ? a->cols : 1},
                  {"size", NULL, w->levels ? l->size : a->rows * (a->cols ? a->cols : 1)},
                  {"table", NULL, w->table},
                  {"derivative", NULL, w->derivative},
                  {"points", NULL, has_table ? table_of(w)->count : 0},
                  {"polynomials", NULL, has_table ? table_of(w)->count - 1 : 0},
                  {"slots", NULL, w->scalar ? w->scalar->slots : 0},
                  {"part", NULL, w->part},
                  {"number", NULL, w->number},
                  {"first", NULL, w->first},
                  {"last", NULL, w->last},
                  {"steps", NULL, l->steps},
                  {"group count", NULL, l->group_count},
                  {"constant count", NULL, l->number_count}};
    for (size_t k = 0; k < sizeof values / sizeof *values; k++)
        if (is(word, length, values[k].word)) {
            if (values[k].text)
                kmp_text_put(w->text, values[k].text);
            else
                kmp_text_printf(w->text, "%ld", values[k].value);
        }
}

static void put_word(const kmp_writer *w, const char *word, size_t length)
{
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        if (is(word, length, texts[k].word)) {
            texts[k].put(w);
            return;
        }
    put_value(w, word, length);
}

/* -- templates --------------------------------------------------------------------------------------- */

static bool is_true(const kmp_writer *w, const char *word, size_t length)
{
    kmp_text value = {0};
    kmp_writer to = *w;
    to.text = &value;
    put_word(&to, word, length);
    bool holds = value.length > 0 && strcmp(value.s, "0") != 0;
    w->text->failed = w->text->failed || value.failed;
    kmp_text_free(&value);
    return holds;
}

/* Fills in up to the end of the template or of its section; not `on`: without writing. The rest of the template. */
static const char *fill(const kmp_writer *w, const char *s, bool on)
{
    const char *word;
    while ((word = strstr(s, "$("))) {
        if (on)
            kmp_text_printf(w->text, "%.*s", (int)(word - s), s);
        word += 2;
        size_t length = strcspn(word, ")");
        s = word + length + 1;
        if (is(word, length, "end"))
            return s;
        if (strncmp(word, "if ", 3) == 0) {
            s = fill(w, s, on && is_true(w, word + 3, length - 3));
        } else if (is(word, length, "each routine")) {
            kmp_writer one = *w;
            for (int k = 0; on && k < w->source->count; k++) {
                one.routine = &w->source->routines[k];
                (void)fill(&one, s, true);
            }
            s = fill(w, s, false);
        } else if (on) {
            put_word(w, word, length);
        }
    }
    if (on)
        kmp_text_put(w->text, s);
    return s + strlen(s);
}

void kmp_fill(const kmp_writer *writer, const char *pattern)
{
    (void)fill(writer, pattern, true);
}

/* -- files ------------------------------------------------------------------------------------------- */

static bool write_page(const kmp_writer *w, const kmp_page *page, kmp_code_files *files)
{
    kmp_text name = {0};
    kmp_writer to = *w;
    to.text = &name;
    kmp_fill(&to, page->name);
    bool wanted = name.length > 0;
    to.text = wanted ? kmp_code_add(files, &name) : NULL;
    if (to.text)
        kmp_fill(&to, page->text);
    kmp_text_free(&name);
    return to.text || !wanted;
}

bool kmp_language_write(const kmp_language *language, const kmp_code_source *source, kmp_code_files *files)
{
    kmp_writer w = {.language = language, .source = source};
    bool ok = true;
    for (const kmp_page *page = language->pages; ok && page->text; page++)
        ok = write_page(&w, page, files);
    for (int k = 0; k < source->count; k++) {
        w.routine = &source->routines[k];
        for (const kmp_page *page = language->routine_pages; ok && page->text; page++)
            ok = write_page(&w, page, files);
    }
    return ok;
}
