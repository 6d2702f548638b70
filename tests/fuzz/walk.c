/* SPDX-License-Identifier: BSD-3-Clause */
/* A model as its user would go on with it. Of the many ways each input takes some, so that it ends soon; large models
 * are not derived. */
#include "fuzz.h"
#include <kempe/check.h>
#include <kempe/generate.h>
#include <stdio.h>

enum { MOST_COORDINATES = 12 };

typedef kempe_status print_fn(const void *object, kempe_format format, char **text);

void fuzz_promise(bool kept, const char *sentence)
{
    if (kept)
        return;
    fprintf(stderr, "promise broken: %s\n", sentence);
    abort();
}

unsigned fuzz_hash(const uint8_t *data, size_t size)
{
    uint32_t hash = 0x811c9dc5u; /* FNV-1a */
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ data[i]) * 0x01000193u;
    return hash ^ hash >> 15;
}

/* -- contexts -------------------------------------------------------------------------------------------- */

static void on_log(void *user, kempe_level level, const char *line)
{
    (void)user, (void)level;
    fuzz_promise(strchr(line, '\n') == NULL, "what is logged is one line");
}

kempe_context *fuzz_context_new(void)
{
    kempe_context *context = kempe_context_new();
    fuzz_promise(context, "there is memory");
    kempe_context_set_log(context, on_log, NULL);
    return context;
}

/* `:line:column: ` somewhere in the line. */
static bool has_place(const char *line, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        size_t n = line[i] == ':' ? 1 : 0, digits = n ? strspn(line + i + 1, "0123456789") : 0;
        if (digits == 0 || line[i + 1 + digits] != ':')
            continue;
        n += digits + 1;
        digits = strspn(line + i + n, "0123456789");
        if (digits > 0 && line[i + n + digits] == ':' && i + n + digits + 2 < length)
            return true;
    }
    return false;
}

static void check_places(const char *message)
{
    while (*message) {
        size_t length = strcspn(message, "\n");
        if (!has_place(message, length))
            fprintf(stderr, "%.*s\n", (int)length, message);
        fuzz_promise(has_place(message, length), "a complaint of an input has a file, a line and a column");
        message += length + (message[length] == '\n');
    }
}

void fuzz_check_sentence(const kempe_context *context, kempe_status status)
{
    const char *message = kempe_context_message(context);
    if (status == KEMPE_E_BUG || status == KEMPE_E_MEMORY)
        fprintf(stderr, "%s\n", message);
    fuzz_promise(status != KEMPE_E_BUG, "no input makes an internal error of Kempe");
    fuzz_promise(status != KEMPE_E_MEMORY, "small inputs need little memory");
    fuzz_promise(status >= 0 || message[0], "a failure has a sentence");
}

void fuzz_check_status(const kempe_context *context, kempe_status status)
{
    fuzz_check_sentence(context, status);
    if (status == KEMPE_E_INPUT)
        check_places(kempe_context_message(context));
}

/* -- results --------------------------------------------------------------------------------------------- */

static void print(const kempe_context *context, print_fn *function, const void *object, kempe_format format)
{
    char *text = NULL;
    kempe_status status = function(object, format, &text);
    fuzz_check_status(context, status);
    fuzz_promise(status != KEMPE_OK || text[0], "what is printed is not empty");
    fuzz_promise(status != KEMPE_OK || format != KEMPE_JSON || fuzz_is_json(text),
                 "JSON can be read by who reads JSON");
    kempe_text_free(text);
}

static kempe_status print_model(const void *object, kempe_format format, char **text)
{
    return kempe_model_print(object, format, text);
}

static kempe_status print_check(const void *object, kempe_format format, char **text)
{
    return kempe_check_print(object, format, text);
}

static kempe_status print_assembly(const void *object, kempe_format format, char **text)
{
    return kempe_assembly_print(object, format, text);
}

static kempe_status print_count(const void *object, kempe_format format, char **text)
{
    return kempe_count_print(object, format, text);
}

static kempe_status print_code(const void *object, kempe_format format, char **text)
{
    return kempe_code_print(object, format, text);
}

static kempe_status print_equations(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_EQUATIONS, format, text);
}

static kempe_status print_program(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_PROGRAM, format, text);
}

static kempe_status print_stats(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_STATS, format, text);
}

static kempe_status print_passes(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_PASSES, format, text);
}

/* -- commands -------------------------------------------------------------------------------------------- */

static void check(const kempe_context *context, const kempe_system *system, kempe_format format)
{
    kempe_check *result = NULL;
    fuzz_check_status(context, kempe_check_new(system, &result));
    if (result)
        print(context, print_check, result, format);
    kempe_check_free(result);
}

static void assemble(const kempe_context *context, const kempe_system *system, kempe_format format)
{
    kempe_assembly *result = NULL;
    fuzz_check_status(context, kempe_assembly_new(system, &result));
    if (result)
        print(context, print_assembly, result, format);
    kempe_assembly_free(result);
}

static void count(const kempe_context *context, const kempe_model *model, unsigned choice)
{
    kempe_generate_options generation = {.keep_parameters = choice & 1, .body_inputs = choice >> 1 & 1};
    kempe_count *result = NULL;
    fuzz_check_status(context, kempe_count_new(model, &generation, &result));
    if (result)
        print(context, print_count, result, choice & 4 ? KEMPE_JSON : KEMPE_TEXT);
    kempe_count_free(result);
}

static void generate(const kempe_context *context, const kempe_model *model, unsigned choice)
{
    static const char *const languages[] = {"c", "octave", "python"};
    kempe_generate_options generation = {.language = languages[choice % 3],
                                         .form = choice & 4 ? "compact" : "legible",
                                         .vectorised = choice % 3 && choice & 8};
    kempe_code *result = NULL;
    fuzz_check_status(context, kempe_code_new(model, &generation, &result));
    if (result)
        print(context, print_code, result, KEMPE_TEXT);
    kempe_code_free(result);
}

/* One view, or what is said of an assembled mechanism. */
static void walk_system(const kempe_context *context, const kempe_system *system, unsigned choice)
{
    static print_fn *const views[] = {print_equations, print_program, print_stats, print_passes};
    kempe_format format = choice & 1 ? KEMPE_JSON : KEMPE_TEXT;
    if (choice / 2 % 8 < 4)
        print(context, views[choice / 2 % 8], system, format);
    else if (choice / 2 % 8 == 4)
        assemble(context, system, format);
    else
        check(context, system, format);
}

void fuzz_walk_model(kempe_context *context, kempe_model *model, unsigned choice)
{
    kempe_system *system = NULL;
    print(context, print_model, model, choice & 1 ? KEMPE_JSON : KEMPE_TEXT);
    if (kempe_model_coordinate_count(model) > MOST_COORDINATES) {
        kempe_model_free(model);
        return;
    }
    switch (choice / 2 % 8) {
    case 0:
        count(context, model, choice / 16);
        break;
    case 1:
        generate(context, model, choice / 16);
        break;
    default:
        fuzz_check_status(context, kempe_system_new(model, &system));
        if (system)
            walk_system(context, system, choice / 16);
        kempe_system_free(system);
    }
    kempe_model_free(model);
}

void fuzz_walk_file(const char *path, unsigned share)
{
    kempe_context *context = fuzz_context_new();
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read(context, path, &model);
    fuzz_check_status(context, status);
    fuzz_promise((status == KEMPE_OK) == (model != NULL), "a model comes with KEMPE_OK, and only then");
    if (model) {
        char *text = NULL;
        fuzz_check_status(context, kempe_model_print(model, KEMPE_JSON, &text));
        unsigned choice = text ? fuzz_hash((const uint8_t *)text, strlen(text)) : 0;
        if (choice % share == 0)
            fuzz_walk_model(context, model, choice / share);
        else
            kempe_model_free(model);
        kempe_text_free(text);
    }
    kempe_context_free(context);
}

kempe_system *fuzz_four_bar(kempe_context *context, kempe_model **model)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground:\n  points: {O: [0, 0, 0], D: [0.9, 0, 0]}\nbodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.1}, points: {B: [0.3, 0, "
        "0]}}\n"
        "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.1}, points: {C: [0.8, 0, "
        "0]}}\n"
        "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.1}, points: {C: [0.7, 0, "
        "0]}}\n"
        "loops: {C: {ball: [coupler.C, rocker.C]}}\n";
    kempe_system *system = NULL;
    kempe_status status = kempe_model_read_text(context, text, "four_bar", model);
    fuzz_check_status(context, status ? status : kempe_system_new(*model, &system));
    fuzz_promise(system, "the four-bar is good");
    return system;
}
