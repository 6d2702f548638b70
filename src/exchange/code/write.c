/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes the files of any language: fills in its templates. */
#include "exchange/code/write.h"
#include "exchange/code/block_parts.h"
#include "exchange/code/language.h"
#include "exchange/code/scalar.h"
#include "exchange/code/start_choice.h"
#include "exchange/code/vectorised.h"
#include "model/data/model.h"
#include "symbolic/ops.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* -- lists ------------------------------------------------------------------------------------------- */

void kmp_put_list_item(kmp_text *text, const kmp_list_spelling *list, int k)
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

void kmp_put_numbers(kmp_text *text, const kmp_language *language, const kmp_list_spelling *list, int count,
                     const double *x)
{
    for (int k = 0; k < count; k++) {
        kmp_put_list_item(text, list, k);
        kmp_language_number(text, language, x[k]);
    }
    kmp_list_end(text, list, count);
}

void kmp_language_string(kmp_text *text, const kmp_language *language, const char *s)
{
    char quote = language->quote;
    kmp_text_printf(text, "%c", quote);
    for (; *s; s++) {
        if (strchr(language->escaped, *s))
            kmp_text_printf(text, "%c", language->escape);
        kmp_text_printf(text, "%c", (unsigned char)*s < 0x20 ? ' ' : *s);
    }
    kmp_text_printf(text, "%c", quote);
}

/* Of a routine, otherwise of all of them. */
static const kmp_table *table_of(const kmp_code_writer *w)
{
    static const kmp_table none;
    if (!w->routine)
        return w->table < w->source->table_count ? w->source->tables[w->table] : &none;
    return w->table < w->routine->program->table_count ? w->routine->program->table[w->table] : &none;
}

static void put_pieces(const kmp_code_writer *w)
{
    const kmp_table *table = table_of(w);
    for (int k = 0; k < table->count - 1; k++) {
        kmp_put_list_item(w->text, &w->language->pieces, k);
        kmp_put_numbers(w->text, w->language, &w->language->piece, 4, table->piece[k]);
    }
    kmp_list_end(w->text, &w->language->pieces, table->count - 1);
}

/* -- functions --------------------------------------------------------------------------------------- */

bool kmp_language_has(const kmp_language *language, kmp_op op)
{
    if (op == KMP_OP_TABLE)
        return language->table_call;
    return !language->functions || kmp_op_form_of(op) != KMP_FORM_FUNCTION || language->functions[op].call;
}

static bool is_used(const kmp_code_writer *w, kmp_op op)
{
    const kmp_program *p;
    bool used = false;
    for (int k = 0; k < w->source->count; k++) {
        const kmp_code_routine *r = &w->source->routines[k];
        if (w->routine && w->routine->program != r->program)
            continue;
        for (int i = 0; (p = kmp_code_next_program(r, &i));)
            for (int at = 0; at < p->code[p->stages] && !used; at++)
                used = p->instruction[at].op == op;
    }
    return used;
}

/* Definitions of the functions that the routine needs, or all routines. */
static void put_functions(const kmp_code_writer *w)
{
    const kmp_function_spelling *functions = w->language->functions;
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        if (op == KMP_OP_LIST || !is_used(w, (kmp_op)op))
            continue;
        if (w->language->define)
            w->language->define(w, (kmp_op)op);
        else if (w->source->vectorised && functions[op].of_arrays)
            kmp_fill(w, functions[op].of_arrays);
        else if (functions[op].definition)
            kmp_fill(w, functions[op].definition);
    }
}

/* -- routines ---------------------------------------------------------------------------------------- */

/* The statements of a stage: all of them, or a function for each chunk before, and its calls. */
static void write_statements(kmp_code_writer *w, kmp_scalar *s, kmp_text *statements)
{
    unsigned used = 0;
    for (int chunk = 0, at = 0; chunk < s->chunks; chunk++) {
        kmp_text own = {0};
        bool split = s->chunks > 1;
        kmp_code_writer part = *w, call = *w;
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
        kmp_text_free_part(w->text, &own);
    }
    w->used = used;
}

static void write_stage(const kmp_code_writer *w, int stage, const char *pattern)
{
    kmp_scalar s;
    kmp_text statements = {0};
    kmp_code_writer in = *w;
    if (!kmp_scalar_init(&s, w->source, w->routine, stage, w->language)) {
        w->text->failed = true;
        return;
    }
    in.scalar = &s;
    in.statements = &statements;
    write_statements(&in, &s, &statements);
    kmp_fill(&in, pattern);
    kmp_text_free_part(w->text, &statements);
    kmp_scalar_free(&s);
}

static void put_prepare(const kmp_code_writer *w)
{
    if (w->source->parameters)
        write_stage(w, 0, w->language->prepare);
}

static void put_blocks(const kmp_code_writer *w)
{
    const kmp_language *l = w->language;
    kmp_arena arena = {0};
    kmp_code_source source;
    kmp_code_writer in = *w;
    in.source = &source;
    const int count = w->routine->blocks ? w->routine->program->block_count : 0;
    if (count > 0 && !kmp_code_block_source(w->source, &arena, &source))
        w->text->failed = true;
    for (int k = 0; k < count && !w->text->failed; k++) {
        const struct kmp_code_block *b = &w->routine->blocks[k];
        for (int part = 0; part < KMP_BLOCK_PARTS; part++) {
            in.routine = &b->part[part];
            if (!in.routine->program)
                continue;
            write_stage(&in, 0, l->inner_prepare ? l->inner_prepare : l->prepare);
            write_stage(&in, 1, l->inner_function ? l->inner_function : l->function);
        }
        l->block(w, b, k);
    }
    kmp_arena_free(&arena);
}

static void put_function(const kmp_code_writer *w)
{
    kmp_nesting_levels levels;
    kmp_code_writer in = *w;
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

/* -- comments ---------------------------------------------------------------------------------------- */

/* A name in a comment: characters that would end the comment are removed. */
static void put_comment_name(kmp_text *text, const char *name)
{
    for (; *name; name++)
        kmp_text_printf(text, "%c", (unsigned char)*name < 0x20 || *name == '*' ? ' ' : *name);
}

static void put_title(const kmp_code_writer *w)
{
    put_comment_name(w->text, w->source->title);
}

/* "q: 0 crank (rad) 1 ..", a few a line, with `each` places for one. */
static void put_legend(const kmp_code_writer *w, const char *of, int count, char *const *names,
                       const kmp_motion *motions, int each)
{
    for (int k = 0; k < count; k++) {
        if (k % 6 == 0)
            kmp_text_printf(w->text, "%s%s %s", k ? "\n" : "", w->mark, k ? "  " : of);
        kmp_text_printf(w->text, " %d ", k * each + w->language->base);
        put_comment_name(w->text, names[k]);
        bool state = motions && kmp_state_of(w->source->model, k);
        kmp_text_put(w->text, !motions              ? ""
                              : state               ? " (integral of the state qd)"
                              : motions[k].rotation ? " (rad)"
                                                    : " (m)");
    }
    kmp_text_put(w->text, count ? "\n" : "");
}

/* Some routine gives the outputs. */
static bool has_outputs(const kmp_code_writer *w)
{
    const char *name = kmp_set_of(NULL, KMP_EQ_OUTPUTS).array;
    for (int k = 0; k < w->source->count; k++)
        for (int a = 0; a < w->source->routines[k].array_count; a++)
            if (strcmp(w->source->routines[k].arrays[a].name, name) == 0)
                return true;
    return false;
}

static void put_legends(const kmp_code_writer *w)
{
    put_legend(w, "q:", w->source->n, w->source->coordinate_names, w->source->model->motions, 1);
    put_legend(w, "h:", w->source->m, w->source->row_names, NULL, 1);
    put_legend(w, "y:", has_outputs(w) ? w->source->output_count : 0, w->source->output_names, NULL, 1);
    put_legend(w, "modes:", w->source->elements.count, w->source->elements.names, NULL, w->source->mode_entries);
    put_legend(w, "u:", w->source->input_count, w->source->input_names, NULL, KMP_TIME_NUMBERS);
}

static void put_comment(const kmp_code_writer *w, const char *mark, const char *pattern)
{
    kmp_code_writer comment = *w;
    comment.mark = mark;
    kmp_fill(&comment, pattern);
}

static void put_banner(const kmp_code_writer *w)
{
    put_comment(w, w->language->mark,
                "$(mark) Equations of '$(title)', written by Kempe " KEMPE_VERSION "\n"
                "$(mark) model $(hash), M by scheme $(scheme), numbers $(if prepared)kept as parameters$(end)"
                "$(if not prepared)folded$(end)$(if inputs), inputs on bodies$(end)\n$(mark)\n"
                "$(mark) M qdd + C = J' lambda, Q = M qdd + C, h = 0, J = dh/dq, J qdd + jdqd = 0; SI units\n"
                "$(mark) operations (+ - * /; with signs and functions; of these for the parameters):\n"
                "$(each routine)$(mark)   $(routine): $(paper); $(robotran); $(once)\n$(end)$(mark)\n$(legends)");
}

static void put_about(const kmp_code_writer *w)
{
    put_comment(
        w, w->language->routine_mark,
        "$(if prepared)$(if takes parameters)$(mark) p: $(parameters), in the order of parameter_names\n$(end)"
        "$(if not takes parameters)$(mark) k: $(kept), by prepare\n$(end)$(end)"
        "$(mark) t: s; q$(if qd), qd$(end)$(if qdd), qdd$(end): $(motions)\n"
        "$(if lambda)$(mark) lambda_: $(rows), multipliers of h\n$(end)"
        "$(if force)$(mark) force, torque: three a body of $(bodies), at its centre of mass, its axes\n$(end)"
        "$(if modes)$(mark) modes: $(mode entries) an element of $(elements): sense of slip (1, -1, or 0), 1 while it\n"
        "$(mark) sticks or is closed, otherwise 0, its place then, a given force$(if begins), a rate of slip that "
        "begins"
        "$(end)\n$(end)"
        "$(if given)$(mark) u: three an input of $(given): value, and for closures its first and second "
        "derivative\n$(end)"
        "$(each array)$(mark) $(array): $(height)$(if columns) x $(columns)$(end), $(meaning)\n$(end)");
}

static void put_runtime(const kmp_code_writer *w)
{
    kmp_runtime_put(w->text, KMP_RUNTIME_FUNCTIONS);
}

static void put_newton(const kmp_code_writer *w)
{
    kmp_runtime_put(w->text, w->language->newton);
}

static void put_helpers(const kmp_code_writer *w)
{
    kmp_runtime_put(w->text, w->language->helpers);
}

static void put_forward(const kmp_code_writer *w)
{
    w->language->forward(w);
}

/* Between items of a list: nothing after a bracket or a blank. */
static void put_comma(const kmp_code_writer *w)
{
    bool begins = w->text->length == 0 || strchr("([ ", w->text->s[w->text->length - 1]);
    kmp_text_put(w->text, begins ? "" : ", ");
}

/* -- words ------------------------------------------------------------------------------------------- */

static bool is(const char *word, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(word, name, length) == 0;
}

/* Words that are replaced by a separate text. */
static const struct {
    const char *word;
    void (*put)(const kmp_code_writer *w);
} texts[] = {{"banner", put_banner}, /* comment on the file */
             {"about", put_about},   /* comment on the routine */
             {"title", put_title},
             {"legends", put_legends},
             {"runtime", put_runtime},     /* kempe/runtime.h */
             {"newton", put_newton},       /* solution of implicit blocks */
             {"helpers", put_helpers},     /* what all functions need */
             {"functions", put_functions}, /* definitions */
             {"pieces", put_pieces},       /* of a table */
             {"forward", put_forward},     /* accelerations */
             {"blocks", put_blocks},       /* that its program solves */
             {"prepare", put_prepare},     /* functions of the routine */
             {"function", put_function},
             {"comma", put_comma},
             {"lists", kmp_vectorised_lists},   /* of the vectorised form: named lists of places and signs */
             {"groups", kmp_vectorised_groups}, /* all operations */
             {"operands", kmp_vectorised_operands},
             {"scatter", kmp_vectorised_results}, /* v into the results */
             {"places", kmp_vectorised_list},     /* items of a list */
             {"signs", kmp_vectorised_list}};

static const kmp_code_routine no_routine;
static const kmp_array no_array;
static const kmp_nesting_levels no_levels;
static const struct kmp_start_choice no_choice;

static bool put_name(const kmp_code_writer *w, const char *word, size_t length)
{
    const struct {
        const char *word, *name;
    } names[] = {{"name", w->source->name},
                 {"hash", w->source->hash},
                 {"scheme", w->source->scheme},
                 {"routine", !w->routine         ? NULL
                             : w->routine->inner ? w->routine->inner
                                                 : w->routine->name},
                 {"static", w->routine && w->routine->inner ? "static " : NULL},
                 {"_prepare", w->scalar && w->scalar->stage == 0 ? "_prepare" : NULL},
                 {"array", w->array ? w->array->name : NULL},
                 {"meaning", w->array ? w->array->meaning : NULL},
                 {"statements", w->statements ? w->statements->s : NULL},
                 {"mark", w->mark}, /* of comments */
                 {"argument", w->argument},
                 {"angle", w->angle},
                 {"sine", w->sine},
                 {"cosine", w->cosine},
                 {"what", w->what}}; /* of a list of places or signs */
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (is(word, length, names[k].word)) {
            kmp_text_put(w->text, names[k].name ? names[k].name : "");
            return true;
        }
    return false;
}

static bool put_list(const kmp_code_writer *w, const char *word, size_t length)
{
    const int base = w->language->base;
    const kmp_code_source *source = w->source;
    const kmp_nesting_levels *l = w->levels ? w->levels : &no_levels;
    const kmp_table *table = table_of(w);
    const struct kmp_start_choice *choice = source->choice ? source->choice : &no_choice;
    const struct {
        const char *word;
        int count;
        char *const *names;
        const double *numbers;
        const int *integers;
        int base; /* what integers are counted from */
    } lists[] = {{"coordinate names", source->n, .names = source->coordinate_names},
                 {"row names", source->m, .names = source->row_names},
                 {"input names", source->input_count, .names = source->input_names},
                 {"output names", source->output_count, .names = source->output_names},
                 {"friction names", source->frictions.count, .names = source->frictions.names},
                 {"contact names", source->contacts.count, .names = source->contacts.names},
                 {"discrete names", source->discrete_count, .names = source->discrete_names},
                 {"delay names", source->delay_count, .names = source->delay_names},
                 {"discrete times", source->discrete_count, .numbers = source->discrete_time},
                 {"parameter names", source->parameter_count, .names = source->parameter_name},
                 {"values", source->parameter_count, .numbers = source->value},
                 {"x", table->count, .numbers = table->x}, /* of a table */
                 {"y", table->count, .numbers = table->y},
                 {"constants", l->number_count, .numbers = l->numbers}, /* at v's beginning */
                 /* The rows of h of elements, and where they begin in modes. */
                 {"friction rows", source->frictions.count, .integers = source->frictions.row, .base = base},
                 {"friction modes", source->frictions.count, .integers = source->frictions.mode, .base = base},
                 {"contact rows", source->contacts.count, .integers = source->contacts.row, .base = base},
                 {"contact modes", source->contacts.count, .integers = source->contacts.mode, .base = base},
                 /* Coordinates and rows at the start. */
                 {"independent", choice->independent_count, .integers = choice->independent, .base = base},
                 {"dependent", choice->dependent_count, .integers = choice->dependent, .base = base},
                 {"independent rows", choice->row_count, .integers = choice->rows, .base = base},
                 /* The places in qd of states with samples or events, and of continuous delays; whether `before` has
                  * the signals of these. */
                 {"discrete places", source->discrete_count, .integers = source->discrete_place, .base = base},
                 {"delay places", source->delay_count, .integers = source->delay_place, .base = base},
                 {"delay given", source->delay_count, .integers = source->delay_given}};
    for (size_t k = 0; k < sizeof lists / sizeof *lists; k++) {
        if (!is(word, length, lists[k].word))
            continue;
        const bool numbers = lists[k].numbers || lists[k].integers;
        const kmp_list_spelling *spelling = numbers ? &w->language->numbers : &w->language->names;
        for (int i = 0; (numbers || lists[k].names) && i < lists[k].count; i++) {
            kmp_put_list_item(w->text, spelling, i);
            if (lists[k].numbers)
                kmp_language_number(w->text, w->language, lists[k].numbers[i]);
            else if (lists[k].integers)
                kmp_text_printf(w->text, "%d", lists[k].integers[i] + lists[k].base);
            else
                kmp_language_string(w->text, w->language, lists[k].names[i]);
        }
        kmp_list_end(w->text, spelling, lists[k].count);
        return true;
    }
    return false;
}

static void put_number(const kmp_code_writer *w, const char *word, size_t length)
{
    const kmp_code_source *source = w->source;
    const kmp_code_routine *r = w->routine ? w->routine : &no_routine;
    const kmp_array *a = w->array ? w->array : &no_array;
    const kmp_nesting_levels *l = w->levels ? w->levels : &no_levels;
    const struct {
        const char *word;
        long number;
    } numbers[] = {{"motions", source->n},
                   {"rows", source->m},
                   {"parameters", source->parameter_count},
                   {"solves", is_used(w, KMP_OP_IMPLICIT)},
                   {"bodies", source->body_count},
                   {"prepared", source->parameters}, /* there are p and k */
                   {"takes parameters", w->language->takes_parameters},
                   {"inputs", source->inputs},
                   {"given", source->input_count},                       /* inputs of the model */
                   {"shown", has_outputs(w) ? source->output_count : 0}, /* outputs, in some routine */
                   {"frictions", source->frictions.count},
                   {"contacts", source->contacts.count},
                   {"elements", source->elements.count}, /* of friction and contacts */
                   {"mode entries", source->mode_entries},
                   {"begins", source->mode_entries > KMP_MODE_ENTRIES},
                   {"discrete", source->discrete_count}, /* states with samples or events */
                   {"delays", source->delay_count},      /* continuous ones */
                   {"modes", source->simulated ? 0 : r->arguments & 1u << KMP_IN_MODE},
                   {"qd", r->arguments & 1u << KMP_IN_QD}, /* it is an argument */
                   {"qdd", r->arguments & 1u << KMP_IN_QDD},
                   {"lambda", r->arguments & 1u << KMP_IN_LAMBDA},
                   {"force", r->arguments & 1u << KMP_IN_FORCE},
                   {"kept", r->kept_count}, /* entries of k */
                   {"kept or 1", r->kept_count ? r->kept_count : 1},
                   {"paper", r->tally.counts.paper},
                   {"robotran", r->tally.counts.robotran},
                   {"once", r->tally.counts.robotran - r->tally.runtime.robotran},
                   {"height", a->rows},
                   {"columns", a->cols},
                   {"columns or 1", a->cols ? a->cols : 1},
                   {"entries", a->rows * (a->cols ? a->cols : 1)},
                   {"has zeros", w->array && w->scalar && kmp_scalar_has_zeros(w->scalar, (int)(a - r->arrays))},
                   {"shared table", kmp_code_table_number(source, table_of(w))}, /* among the tables of all routines */
                   {"derivative", w->derivative},
                   {"points", table_of(w)->count},
                   {"polynomials", table_of(w)->count - 1},
                   {"is time", w->kind == KMP_IN_TIME}, /* the argument */
                   {"is state", w->kind >= KMP_IN_Q},
                   {"is argument", w->kind >= KMP_IN_TIME}, /* not k */
                   {"slots", w->scalar ? w->scalar->slots : 0},
                   {"slots used", w->scalar && w->scalar->slots_used},
                   {"part", w->part},
                   {"number", w->number}, /* of a list of places or signs, of a block */
                   {"count", w->count},
                   {"first", w->first},
                   {"last", w->last},
                   {"size", l->size},            /* of v */
                   {"width", l->width[w->kind]}, /* of the argument in v */
                   {"steps", l->steps},
                   {"group count", l->group_count},
                   {"constant count", l->number_count}};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        if (is(word, length, numbers[k].word))
            kmp_text_printf(w->text, "%ld", numbers[k].number);
}

static void put_word(const kmp_code_writer *w, const char *word, size_t length)
{
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        if (is(word, length, texts[k].word)) {
            texts[k].put(w);
            return;
        }
    if (!put_name(w, word, length) && !put_list(w, word, length))
        put_number(w, word, length);
}

/* -- loops ------------------------------------------------------------------------------------------- */

static bool take_routine(kmp_code_writer *w, int k)
{
    w->routine = &w->source->routines[k];
    return true;
}

static bool take_array(kmp_code_writer *w, int k)
{
    w->array = &w->routine->arrays[k];
    w->argument = w->array->name;
    return true;
}

static bool take_empty_array(kmp_code_writer *w, int k)
{
    return take_array(w, k) && w->array->count == 0;
}

static bool take_shared_table(kmp_code_writer *w, int k)
{
    w->routine = NULL;
    w->table = k;
    return true;
}

/* A shared table that the routine has, or one of its blocks. */
static bool take_own_table(kmp_code_writer *w, int k)
{
    const bool own = kmp_code_has_table(w->routine, w->source->tables[k]);
    return take_shared_table(w, k) && own;
}

/* An argument, with its places in the vector of the vectorised form. */
static bool take_input(kmp_code_writer *w, int kind)
{
    w->argument = kmp_argument_names[kind];
    w->kind = kind;
    if (w->levels) {
        w->first = w->levels->at[kind] + w->language->base;
        w->last = w->levels->at[kind] + w->levels->width[kind];
    }
    return w->routine->arguments >> kind & 1 || (kind == KMP_IN_PARAMETER && w->source->parameters);
}

/* The arguments of a function of the parameters that has no statements. */
static bool take_unread_parameter(kmp_code_writer *w, int k)
{
    w->argument = k ? "k" : "p";
    return w->part > 0 || (w->scalar->chunks == 1 && w->scalar->sink_count == 0);
}

static void repeat(const kmp_code_writer *w, const char *word, size_t length, const char *pattern)
{
    const kmp_code_routine *r = w->routine;
    const int arrays = r ? r->array_count : 0;
    const unsigned all = ~0u;
    const struct {
        const char *word;
        int count;
        bool (*take)(kmp_code_writer *w, int k); /* false: the item is left out */
        unsigned among; /* items as bits: all, or the ones that a function reads or a part writes */
    } loops[] = {{"each routine", w->source->count, take_routine, all},
                 {"each array", arrays, take_array, all},
                 {"each written array", arrays, take_array, w->arrays},
                 {"each empty array", arrays, take_empty_array, all},
                 {"each shared table", w->source->table_count, take_shared_table, all},
                 {"each own table", r ? w->source->table_count : 0, take_own_table, all},
                 {"each input", KMP_ARGUMENTS, take_input, all},
                 {"each read input", KMP_ARGUMENTS, take_input, w->used},
                 {"each unread input", KMP_ARGUMENTS, take_input, ~w->used},
                 {"each unread parameter", 2, take_unread_parameter, all}};
    for (size_t n = 0; n < sizeof loops / sizeof *loops; n++)
        for (int k = 0; is(word, length, loops[n].word) && k < loops[n].count; k++) {
            kmp_code_writer one = *w;
            if (loops[n].take(&one, k) && (loops[n].among == all || loops[n].among >> k & 1))
                kmp_fill(&one, pattern);
        }
}

/* -- templates --------------------------------------------------------------------------------------- */

static bool begins(const char *word, const char *with)
{
    return strncmp(word, with, strlen(with)) == 0;
}

/* The word is neither empty nor 0. */
static bool holds(const kmp_code_writer *w, const char *word, size_t length)
{
    kmp_text value = {0};
    kmp_code_writer to = *w;
    to.text = &value;
    put_word(&to, word, length);
    bool is_one = value.length > 0 && strcmp(value.s, "0") != 0;
    kmp_text_free_part(w->text, &value);
    return is_one;
}

/* Fills in up to the end of the template or of its section; not `on`: without writing. The rest of the template. */
static const char *fill(const kmp_code_writer *w, const char *s, bool on)
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
        if (begins(word, "if not ")) {
            s = fill(w, s, on && !holds(w, word + 7, length - 7));
        } else if (begins(word, "if ")) {
            s = fill(w, s, on && holds(w, word + 3, length - 3));
        } else if (begins(word, "each ")) {
            if (on)
                repeat(w, word, length, s);
            s = fill(w, s, false);
        } else if (on) {
            put_word(w, word, length);
        }
    }
    if (on)
        kmp_text_put(w->text, s);
    return s + strlen(s);
}

void kmp_fill(const kmp_code_writer *writer, const char *pattern)
{
    (void)fill(writer, pattern, true);
}

/* -- files ------------------------------------------------------------------------------------------- */

static bool write_page(const kmp_code_writer *w, const kmp_page *page, kmp_code_files *files)
{
    kmp_text name = {0};
    kmp_code_writer to = *w;
    to.text = &name;
    kmp_fill(&to, page->name);
    bool wanted = name.length > 0;
    to.text = wanted ? kmp_code_add(files, "%s", name.s) : NULL;
    if (to.text)
        kmp_fill(&to, page->text);
    kmp_text_free(&name);
    return to.text || !wanted;
}

bool kmp_language_write(const kmp_language *language, const kmp_code_source *source, kmp_code_files *files)
{
    kmp_code_writer w = {.language = language, .source = source};
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
