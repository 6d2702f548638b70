/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensors, which are named expressions, and the outputs of a run: the rows of output_kinds.def. Lists of outputs and
 * inputs in options are read by the same functions. */
#include "model/read/read_outputs.h"
#include "base/memory.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <string.h>

/* -- sensors ------------------------------------------------------------------------------------- */

void kmp_read_sensors(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "sensors", "sensor");
    model->sensors = KMP_ARENA_NEW(&model->arena, kmp_sensor, s.count);
    while (model->sensors && kmp_section_next(&s)) {
        kmp_sensor *sensor = &model->sensors[model->sensor_count++];
        *sensor = (kmp_sensor){.name = s.name, .place = s.key->place};
        sensor->expr = kmp_read_expr(r, s.node, s.what, KMP_DIM_ANY, KMP_OF_MOTION);
    }
}

/* -- arguments ----------------------------------------------------------------------------------- */

static int find_thing(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    static const char *const kinds[] = {
        [KMP_OUTPUT_OF_MAYBE_LOOP] = "loop", [KMP_OUTPUT_OF_LOOP] = "loop",     [KMP_OUTPUT_OF_MAYBE_STATE] = "state",
        [KMP_OUTPUT_OF_FORCE] = "force",     [KMP_OUTPUT_OF_SENSOR] = "sensor", [KMP_OUTPUT_OF_WHEEL] = "wheel"};
    const char *kind = kinds[row->argument];
    kmp_name_list names = kmp_output_names(r->model, row->argument);
    int found = kmp_name_find(names, name);
    if (found >= 0)
        return found;
    kmp_nearest nearest = kmp_nearest_of(name, names);
    if (strcmp(kind, "loop") == 0 && kmp_joint_find(r->model, name) >= 0)
        kmp_reader_complain(r, node->place,
                            "output %s: joint '%s' is in the tree and has no multipliers; reaction(%s) and moment(%s) "
                            "are its load, and 'cut: yes' makes it a closure",
                            row->word, name, name, name);
    else
        kmp_reader_complain_near(r, node->place, &nearest, "output %s: unknown %s '%s'", row->word, kind, name);
    return -1;
}

/* Elastic wheels have no multiplier: the message names the right word. */
static bool is_elastic(kmp_reader *r, const kmp_yaml *node, const char *word, const char *name)
{
    int k = kmp_name_find(KMP_NAMED(r->model, wheel), name);
    if (k < 0 || r->model->wheels[k].form != KMP_CONTACT_ELASTIC)
        return false;
    kmp_reader_complain(r, node->place,
                        "output %s: wheel '%s' is elastic and has no multiplier; contact(%s) has its normal force",
                        word, name, name);
    return true;
}

/* A body that moves; -1 after an error message. */
static int find_body(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    const kmp_yaml word = {.kind = KMP_YAML_SCALAR, .place = node->place, .text = name};
    int body = kmp_read_body(r, &word, kmp_reader_say(r, "output %s", row->word));
    if (body == 0)
        kmp_reader_complain(r, node->place, "output %s: the ground does not move", row->word);
    return body > 0 ? body : -1;
}

/* "arm", "arm about ground.O", "about ground.O". */
static void read_about(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name,
                       kmp_output *output)
{
    const char *word = strncmp(name, "about ", 6) == 0 ? name : strstr(name, " about ");
    if (row->argument != KMP_OUTPUT_OF_MAYBE_BODY_ABOUT)
        word = NULL;
    if (word) {
        const char *point = word + strspn(word, " ") + 5;
        output->about = 1 + kmp_read_point_text(r, node->place, point + strspn(point, " "),
                                                kmp_reader_say(r, "output %s", row->word));
    }
    if (word != name)
        output->index = find_body(r, node, row, word ? kmp_reader_say(r, "%.*s", (int)(word - name), name) : name);
}

/* The kind for a joint of the tree in place of that for a loop of no such name, and for a coordinate of a cut joint. */
static kmp_output_kind kind_for(const kmp_reader *r, kmp_output_kind kind, const char *name)
{
    if (kind <= KMP_OUTPUT_QDD && kmp_cut_coordinate_find(r->model, name) >= 0)
        return KMP_OUTPUT_CUT_Q + kind - KMP_OUTPUT_Q;
    bool loop = kmp_output_rows[kind].argument == KMP_OUTPUT_OF_LOOP;
    if (!loop || kmp_name_find(KMP_NAMED(r->model, closure), name) >= 0 || kmp_joint_find(r->model, name) < 0)
        return kind;
    return kind == KMP_OUTPUT_MOMENT ? KMP_OUTPUT_JOINT_MOMENT : KMP_OUTPUT_JOINT_REACTION;
}

/* A joint of the tree, less one. */
static int find_carried(kmp_reader *r, const kmp_yaml *node, const char *word, const char *name)
{
    int body = kmp_joint_find(r->model, name);
    const char *obstacle = kmp_joint_obstacle(r->model, body);
    if (obstacle)
        kmp_reader_complain(r, node->place, "output %s: the load of joint '%s' is not known: %s", word, name, obstacle);
    return body - 1;
}

static int find_argument(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    const char *what = kmp_reader_say(r, "output %s", row->word);
    if (row->argument == KMP_OUTPUT_OF_MAYBE_COORDINATE)
        return kmp_read_motion_text(r, node->place, name, what);
    if (row->argument == KMP_OUTPUT_OF_CUT)
        return kmp_cut_coordinate_find(r->model, name);
    if (row->argument == KMP_OUTPUT_OF_POINT)
        return kmp_read_point_text(r, node->place, name, what);
    if (row->argument == KMP_OUTPUT_OF_JOINT)
        return find_carried(r, node, row->word, name);
    bool loop = row->argument == KMP_OUTPUT_OF_MAYBE_LOOP || row->argument == KMP_OUTPUT_OF_LOOP;
    if (loop && is_elastic(r, node, row->word, name))
        return -1;
    int found = find_thing(r, node, row, name);
    bool gap = row == &kmp_output_rows[KMP_OUTPUT_GAP];
    if (gap && found >= 0 && r->model->forces[found].kind != KMP_FORCE_TOUCH)
        kmp_reader_complain(r, node->place, "output gap: '%s' is no rigid contact", name);
    else if (row->argument == KMP_OUTPUT_OF_FORCE && found >= 0 && kmp_force_has_components(&r->model->forces[found]))
        kmp_reader_complain(r, node->place, "output force: '%s' is given by its components", name);
    return found;
}

/* -- outputs ------------------------------------------------------------------------------------- */

const char *kmp_read_argument(kmp_reader *r, const char *text, const char *word)
{
    size_t length = strlen(text), head = strlen(word);
    if (length < head + 3 || strncmp(text, word, head) != 0 || text[head] != '(' || text[length - 1] != ')')
        return NULL;
    return kmp_reader_say(r, "%.*s", (int)(length - head - 2), text + head + 1);
}

static void complain_output(kmp_reader *r, const kmp_yaml *node)
{
    kmp_nearest nearest = kmp_nearest_of(node->text, KMP_NAMES_OF(kmp_output_rows));
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, sensor));
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, state));
    kmp_reader_complain_near(
        r, node->place, &nearest,
        "unknown output '%s'; available: q, qd, qdd, lambda, energy, q(JOINT), angle(JOINT), qd(JOINT), qdd(JOINT), "
        "lambda(LOOP), reaction(LOOP), reaction(JOINT), position(BODY.POINT), velocity(BODY.POINT), "
        "acceleration(BODY.POINT), "
        "force(FORCE), gap(CONTACT), sensor(SENSOR), contact(WHEEL), momentum(BODY), angular_momentum(BODY)",
        node->text);
}

static bool read_word(kmp_reader *r, const char *text, kmp_output *output)
{
    for (int i = 0; i < KMP_OUTPUT_KINDS; i++)
        if (kmp_output_stands_alone((kmp_output_kind)i) && strcmp(kmp_output_rows[i].word, text) == 0) {
            *output = (kmp_output){.kind = (kmp_output_kind)i, .index = -1};
            return true;
        }
    int sensor = kmp_name_find(KMP_NAMED(r->model, sensor), text);
    int state = sensor < 0 ? kmp_name_find(KMP_NAMED(r->model, state), text) : -1;
    if (sensor >= 0)
        *output = (kmp_output){.kind = KMP_OUTPUT_SENSOR, .index = sensor};
    if (state >= 0)
        *output = (kmp_output){.kind = KMP_OUTPUT_STATE, .index = state};
    return sensor >= 0 || state >= 0;
}

static void read_output(kmp_reader *r, const kmp_yaml *node, kmp_output *output)
{
    const char *text = kmp_read_word(r, node, "an output");
    if (!text || read_word(r, text, output))
        return;
    for (int i = 0; i < KMP_OUTPUT_KINDS; i++) {
        const kmp_output_row *row = &kmp_output_rows[i];
        const char *name = row->argument == KMP_OUTPUT_OF_NOTHING ? NULL : kmp_read_argument(r, text, row->word);
        if (!name && i == KMP_OUTPUT_Q)
            name = kmp_read_argument(r, text, "angle");
        if (name) {
            *output = (kmp_output){.kind = kind_for(r, (kmp_output_kind)i, name), .index = -1};
            row = &kmp_output_rows[output->kind];
            if (row->argument == KMP_OUTPUT_OF_MAYBE_BODY || row->argument == KMP_OUTPUT_OF_MAYBE_BODY_ABOUT)
                read_about(r, node, row, name, output);
            else
                output->index = find_argument(r, node, row, name);
            return;
        }
    }
    complain_output(r, node);
}

void kmp_read_outputs(kmp_reader *r, const kmp_yaml *list)
{
    kempe_model *model = r->model;
    if (!list) {
        int last = model->state_count > 0 ? KMP_OUTPUT_STATE : KMP_OUTPUT_LAMBDA;
        model->outputs = KMP_ARENA_NEW(&model->arena, kmp_output, last + 1);
        for (int i = 0; model->outputs && i <= last; i++)
            model->outputs[model->output_count++] = (kmp_output){.kind = (kmp_output_kind)i, .index = -1};
        return;
    }
    if (!kmp_read_list(r, list, "run outputs", -1))
        return;
    model->outputs = KMP_ARENA_NEW(&model->arena, kmp_output, list->count);
    for (int i = 0; model->outputs && i < list->count; i++)
        read_output(r, list->items[i], &model->outputs[model->output_count++]);
}

/* -- lists of users ---------------------------------------------------------------------------------- */

/* Output and input names in options are parsed by the reader's own functions for a model file, on a copy of the model.
 * Errors begin with the list's name in place of file, line and column. */

/* A reader of words outside a file: the list's name takes the place of the file's. */
typedef struct asking {
    kmp_reader r;
    kempe_model model; /* a copy, except for the names of its files, and its arena */
    const char *label[1];
    kmp_place place; /* of the words; no line: they are named by the label alone */
    int count;
    char **word;
} asking;

static const kmp_place nowhere = {0, 0, 0};

static kempe_status begin(asking *a, const kempe_model *model, const char *what, const char *words)
{
    kempe_status status = kmp_model_check_finished(model);
    *a = (asking){.model = *model, .label = {what}};
    a->model.arena = (kmp_arena){0};
    a->model.files = a->label;
    a->model.file_count = 1;
    a->r = (kmp_reader){.context = model->context, .model = &a->model, .file = what};
    if (status != KEMPE_OK)
        return status;
    a->count = kmp_text_words(&a->r.scratch, words, &a->word);
    return a->r.scratch.failed ? kmp_fail_memory(model->context) : KEMPE_OK;
}

/* Ends reading after errors: returns their status. */
static kempe_status end(asking *a, kempe_status status)
{
    bool memory = !a->r.scratch.failed && !a->model.arena.failed;
    if (status == KEMPE_OK && a->r.wrong)
        status = KEMPE_E_ARGUMENT;
    kmp_arena_free(&a->r.scratch);
    kmp_arena_free(&a->model.arena);
    return memory ? status : kmp_fail_memory(a->r.context);
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* True if the word up to `length` is an output of several values without an object. */
static bool stands_alone(const char *word, size_t length)
{
    for (int k = 0; k < KMP_OUTPUT_KINDS; k++)
        if (kmp_output_stands_alone((kmp_output_kind)k) && kmp_output_rows[k].width > 1 &&
            strlen(kmp_output_rows[k].word) == length && strncmp(word, kmp_output_rows[k].word, length) == 0)
            return true;
    return false;
}

/* A component by the end of its column's name: found when the object is known. */
enum { NAMED = -2 };

/* Removes ".x" from "position(b.P).x", ".total" from "energy.total". -1: the output has all its components. */
static int cut_component(char *word)
{
    char *dot = strrchr(word, '.');
    if (!dot || dot == word || (dot[-1] != ')' && !stands_alone(word, (size_t)(dot - word))))
        return -1;
    *dot = '\0';
    return NAMED;
}

/* The words as the list of the file that they might be, and the component of each. */
static bool list_words(asking *a, kmp_yaml *list, int *component)
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
static int component_named(asking *a, const kmp_output *output, const char *whole, const char *word)
{
    int width = kmp_output_width(&a->model, output);
    const char *output_word = kmp_output_rows[output->kind].word;
    if (width < 2) {
        kmp_reader_complain(&a->r, a->place, "'%s': %s has no components", whole, output_word);
        return -1;
    }
    const char **names = KMP_ARENA_NEW(&a->r.scratch, const char *, width);
    for (int k = 0; names && k < width; k++) {
        kmp_text column = {0};
        kmp_output_column(&column, &a->model, output, k);
        const char *name = kmp_reader_take(&a->r, &column), *dot = strrchr(name, '.');
        names[k] = dot ? dot + 1 : name;
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
    return kmp_requested_outputs_at(copy, "outputs", nowhere, words, parts);
}

kempe_status kmp_requested_outputs_at(kempe_model *copy, const char *label, kmp_place place, const char *words,
                                      unsigned **parts)
{
    asking a;
    kmp_yaml list;
    int *component = NULL;
    kempe_status status = begin(&a, copy, label, words);
    if (status != KEMPE_OK)
        return end(&a, status);
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
                component[k] = component_named(&a, output, a.word[k], strrchr(a.word[k], '.') + 1);
        }
    }
    copy->arena = a.model.arena;
    a.model.arena = (kmp_arena){.failed = copy->arena.failed};
    if (a.r.wrong || a.r.scratch.failed || copy->arena.failed)
        return end(&a, status);
    copy->outputs = a.model.outputs;
    copy->output_count = a.model.output_count;
    return end(&a, gather(copy, component, parts) ? KEMPE_OK : kmp_fail_memory(copy->context));
}

int kmp_requested_position(kempe_model *copy, int point, unsigned **parts)
{
    int count = copy->output_count;
    kmp_output *outputs = KMP_ARENA_NEW(&copy->arena, kmp_output, count + 1);
    unsigned *bits = KMP_ARENA_NEW(&copy->arena, unsigned, count + 1);
    if (!outputs || !bits)
        return -1;
    for (int k = 0; k < count; k++) {
        outputs[k] = copy->outputs[k];
        bits[k] = *parts ? (*parts)[k] : ~0u;
    }
    outputs[count] = (kmp_output){.kind = KMP_OUTPUT_POSITION, .index = point};
    copy->outputs = outputs;
    *parts = bits;
    return copy->output_count++;
}

/* -- inputs ------------------------------------------------------------------------------------------ */

static int find_drive(asking *a, const char *name)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int k = 0; k < a->model.closure_count; k++) {
        if (a->model.closures[k].kind != KMP_CLOSURE_drive)
            continue;
        if (strcmp(a->model.closures[k].name, name) == 0)
            return k;
        kmp_nearest_offer(&nearest, a->model.closures[k].name);
    }
    kmp_reader_complain_near(&a->r, nowhere, &nearest, "the model has no drive '%s'", name);
    return -1;
}

static bool add(asking *a, kmp_requested_inputs *inputs, kmp_requested_input input, const char *name)
{
    for (int k = 0; k < inputs->count; k++)
        if (strcmp(inputs->input[k].name, name) == 0) {
            kmp_reader_complain(&a->r, nowhere, "'%s' is given twice", name);
            return true;
        }
    input.name = kmp_strdup(name);
    inputs->input[inputs->count] = input;
    inputs->count += input.name != NULL;
    return input.name;
}

/* BODY.POINT.x, or BODY.POINT for all three. */
static bool add_force(asking *a, kmp_requested_inputs *inputs, const char *argument)
{
    static const char *const axes[] = {"x", "y", "z"};
    const char *dot = strrchr(argument, '.');
    bool three = !dot || dot == strchr(argument, '.');
    int only = three ? -1 : kmp_name_find(KMP_NAMES_OF(axes), dot + 1);
    if (only >= 0)
        argument = kmp_reader_say(&a->r, "%.*s", (int)(dot - argument), argument);
    int point = kmp_read_point_text(&a->r, nowhere, argument, "force");
    bool ok = true;
    for (int axis = 0; point >= 0 && ok && axis < 3; axis++)
        if (only < 0 || only == axis)
            ok = add(a, inputs, (kmp_requested_input){KMP_REQUESTED_FORCE, point, axis, NULL},
                     kmp_reader_say(&a->r, "force(%s.%s)", argument, axes[axis]));
    return ok;
}

static bool add_word(asking *a, kmp_requested_inputs *inputs, const char *word)
{
    const char *argument = kmp_read_argument(&a->r, word, "force");
    if (argument)
        return add_force(a, inputs, argument);
    kmp_requested_input input = {KMP_REQUESTED_PARAMETER, -1, 0, NULL};
    if ((argument = kmp_read_argument(&a->r, word, "effort"))) {
        input.kind = KMP_REQUESTED_EFFORT;
        input.index = kmp_read_motion_text(&a->r, nowhere, argument, "effort");
    } else if ((argument = kmp_read_argument(&a->r, word, "drive"))) {
        input.kind = KMP_REQUESTED_DRIVE;
        input.index = find_drive(a, argument);
    } else if ((input.index = kempe_model_input_find(&a->model, word)) >= 0) {
        input.kind = KMP_REQUESTED_INPUT;
    } else if (strchr(word, '(')) {
        kmp_reader_complain(&a->r, nowhere,
                            "unknown input '%s'; available: effort(JOINT), force(BODY.POINT.x), force(BODY.POINT), "
                            "drive(DRIVE), and the names of inputs and parameters",
                            word);
        return true;
    }
    return input.kind != KMP_REQUESTED_PARAMETER && input.index < 0 ? true : add(a, inputs, input, word);
}

kempe_status kmp_requested_inputs_read(const kempe_model *model, const char *words, kmp_requested_inputs *inputs)
{
    asking a;
    kmp_requested_inputs read = {0};
    kempe_status status = begin(&a, model, "inputs", words);
    if (status == KEMPE_OK) {
        read.input = KMP_NEW(kmp_requested_input, 3 * a.count);
        bool ok = read.input;
        for (int k = 0; ok && k < a.count; k++)
            ok = add_word(&a, &read, a.word[k]);
        status = ok ? KEMPE_OK : kmp_fail_memory(model->context);
    }
    status = end(&a, status);
    if (status == KEMPE_OK)
        *inputs = read;
    else
        kmp_requested_inputs_free(&read);
    return status;
}

void kmp_requested_inputs_free(kmp_requested_inputs *inputs)
{
    for (int k = 0; k < inputs->count; k++)
        kmp_free(inputs->input[k].name);
    kmp_free(inputs->input);
    *inputs = (kmp_requested_inputs){0};
}
