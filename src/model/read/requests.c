/* SPDX-License-Identifier: BSD-3-Clause */
/* The words are parsed by the reader's own functions for a model file, on a copy of the model. */
#include "model/read/requests.h"
#include "model/data/output_table.h"
#include "model/language/nearest.h"
#include "model/read/read_outputs.h"
#include <string.h>

kempe_status kmp_request_begin(kmp_request *a, const kempe_model *model, const char *what, const char *words)
{
    kempe_status status = kmp_model_check_finished(model);
    *a = (kmp_request){.model = *model, .label = {what}};
    a->model.arena = (kmp_arena){0};
    a->model.source.files = a->label;
    a->model.source.file_count = 1;
    a->r = (kmp_reader){.context = model->context, .model = &a->model, .file = what};
    if (status != KEMPE_OK)
        return status;
    a->count = kmp_text_words(&a->r.scratch, words, &a->word);
    return a->r.scratch.failed ? kmp_fail_memory(model->context) : KEMPE_OK;
}

kempe_status kmp_request_end(kmp_request *a, kempe_status status)
{
    bool memory = !a->r.scratch.failed && !a->model.arena.failed;
    if (status == KEMPE_OK && a->r.wrong)
        status = KEMPE_E_ARGUMENT;
    kmp_arena_free(&a->r.scratch);
    kmp_arena_free(&a->model.arena);
    return memory ? status : kmp_fail_memory(a->r.context);
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* A component by the end of its column's name: found when the object is known. */
enum { NAMED = -2 };

/* The component of a word: ".x" of "position(b.P).x", ".1.x" of "bearing(main).1.x", ".total" of "energy.total"; NULL:
 * there is none. */
static const char *find_component(const char *word)
{
    const char *close = strrchr(word, ')');
    return close && close[1] == '.' ? close + 1 : strrchr(word, '.');
}

/* Removes it. -1: the output has all its components. */
static int cut_component(char *word)
{
    const char *dot = find_component(word);
    if (!dot || dot == word)
        return -1;
    const size_t length = (size_t)(dot - word);
    bool cut = dot[-1] == ')';
    for (int k = 0; k < KMP_OUTPUT_KINDS && !cut; k++) /* an output of several values without an object */
        cut = kmp_output_stands_alone((kmp_output_kind)k) && kmp_output_rows[k].width > 1 &&
              strlen(kmp_output_rows[k].word) == length && strncmp(word, kmp_output_rows[k].word, length) == 0;
    if (cut)
        word[length] = '\0';
    return cut ? NAMED : -1;
}

/* The words as the list of the file that they might be, and the component of each. */
static bool list_words(kmp_request *a, kmp_yaml *list, int *component)
{
    kmp_yaml *node = KMP_ARENA_NEW(&a->r.scratch, kmp_yaml, a->count);
    const kmp_yaml **items = KMP_ARENA_NEW(&a->r.scratch, const kmp_yaml *, a->count);
    for (int k = 0; node && items && k < a->count; k++) {
        char *word = kmp_arena_strdup(&a->r.scratch, a->word[k]);
        if (!word)
            return false;
        component[k] = cut_component(word);
        node[k] = (kmp_yaml){.kind = KMP_YAML_SCALAR, .place = a->place, .text_place = a->place, .text = word};
        items[k] = &node[k];
    }
    *list = (kmp_yaml){.kind = KMP_YAML_LIST, .count = a->count, .items = items, .text = ""};
    return node && items;
}

/* The component of an output whose column ends with a word; -1 after a message. */
static int component_named(kmp_request *a, const kmp_output *output, const char *whole, const char *word)
{
    int width = kmp_output_width(&a->model, output);
    const char *output_word = kmp_output_rows[output->kind].word;
    if (width < 2) {
        kmp_reader_complain(&a->r, a->place, "'%s': %s has no components", whole, output_word);
        return -1;
    }
    /* "bearing(main)" is as long as "bearing.main.", behind which the column has "1.x". */
    kmp_text printed = {0};
    kmp_output_print(&printed, &a->model, output);
    const size_t before = strlen(kmp_reader_take(&a->r, &printed));
    const char **names = KMP_ARENA_NEW(&a->r.scratch, const char *, width);
    for (int k = 0; names && k < width; k++) {
        kmp_text column = {0};
        kmp_output_column(&column, &a->model, output, k);
        const char *name = kmp_reader_take(&a->r, &column), *dot = strrchr(name, '.');
        names[k] = strchr(word, '.') ? name + before : dot ? dot + 1 : name;
    }
    kmp_text why = {0};
    const char *kind = kmp_reader_say(&a->r, "component of %s", output_word);
    int found = names ? kmp_word_find(word, KMP_NAMES(names, width), kind, &why) : width;
    if (names && found == width)
        kmp_reader_complain(&a->r, a->place, "'%s': %s", whole, kmp_reader_take(&a->r, &why));
    return found < width ? found : -1;
}

/* Lists each output once, in the order of the request, with all requested components. */
static bool gather(kempe_model *model, const int *component, unsigned **parts)
{
    int count = model->output_count, kept = 0;
    *parts = KMP_ARENA_NEW(&model->arena, unsigned, count);
    for (int k = 0; *parts && k < count; k++) {
        kmp_output output = model->outputs[k];
        int at = 0;
        while (at < kept && !kmp_output_equal(&model->outputs[at], &output))
            at++;
        kept += at == kept;
        model->outputs[at] = output;
        (*parts)[at] |= component[k] < 0 ? ~0u : 1u << component[k];
    }
    model->output_count = kept;
    return *parts;
}

kempe_status kmp_requested_outputs(kempe_model *copy, const char *words, unsigned **parts)
{
    return kmp_requested_outputs_at(copy, "outputs", (kmp_place){0}, words, parts);
}

kempe_status kmp_requested_outputs_at(kempe_model *copy, const char *label, kmp_place place, const char *words,
                                      unsigned **parts)
{
    kmp_request a;
    kmp_yaml list;
    int *component = NULL;
    kempe_status status = kmp_request_begin(&a, copy, label, words);
    if (status != KEMPE_OK)
        return kmp_request_end(&a, status);
    a.place = place;
    component = KMP_ARENA_NEW(&a.r.scratch, int, a.count);
    a.model.outputs = NULL;
    a.model.output_count = 0;
    a.model.arena = copy->arena;
    if (component && list_words(&a, &list, component))
        kmp_read_outputs(&a.r, &list);
    if (a.model.output_count == a.count) {
        /* Components that are asked for by name. */
        for (int k = 0; k < a.count && !a.r.wrong; k++) {
            const kmp_output *output = &a.model.outputs[k];
            if (component[k] == NAMED)
                component[k] = component_named(&a, output, a.word[k], find_component(a.word[k]) + 1);
        }
    }
    copy->arena = a.model.arena;
    a.model.arena = (kmp_arena){.failed = copy->arena.failed};
    if (a.r.wrong || a.r.scratch.failed || copy->arena.failed)
        return kmp_request_end(&a, status);
    copy->outputs = a.model.outputs;
    copy->output_count = a.model.output_count;
    return kmp_request_end(&a, gather(copy, component, parts) ? KEMPE_OK : kmp_fail_memory(copy->context));
}
