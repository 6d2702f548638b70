/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensors, which are named expressions, and the outputs of a run: the rows of output_kinds.def. */
#include "model/read/reading.h"
#include "model/tables/output_table.h"
#include <string.h>

/* -- sensors ------------------------------------------------------------------------------------- */

void kmp_read_sensors(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_yaml *map = kmp_yaml_get(r->root, "sensors");
    if (!map || !kmp_read_map(r, map, "sensors", NULL))
        return;
    model->sensors = KMP_ARENA_NEW(&model->arena, kmp_sensor, map->count);
    for (int i = 0; model->sensors && i < map->count; i++) {
        kmp_sensor *sensor = &model->sensors[i];
        kmp_read_name(r, map->keys[i], "a sensor");
        sensor->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        sensor->place = map->keys[i]->place;
        if (!sensor->name)
            return;
        model->sensor_count++;
        sensor->expr = kmp_read_effort(r, map->items[i], kmp_reader_say(r, "sensor '%s'", sensor->name), KMP_DIM_ANY);
    }
}

/* -- arguments ----------------------------------------------------------------------------------- */

/* Named things that an output may refer to. */
typedef struct things {
    const char *what;
    int count;
    const char *(*name)(const kempe_model *model, int k);
} things;

static const char *closure_name(const kempe_model *model, int k)
{
    return model->closures[k].name;
}

static const char *force_name(const kempe_model *model, int k)
{
    return model->forces[k].name;
}

static const char *sensor_name(const kempe_model *model, int k)
{
    return model->sensors[k].name;
}

static const char *wheel_name(const kempe_model *model, int k)
{
    return model->wheels[k].name;
}

static int find_thing(kmp_reader *r, const kmp_yaml *node, const char *word, things list, const char *name)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int i = 0; i < list.count; i++) {
        if (strcmp(list.name(r->model, i), name) == 0)
            return i;
        kmp_nearest_offer(&nearest, list.name(r->model, i));
    }
    if (list.name == closure_name && kmp_linkage_find(r, name) == KMP_LINKED_TREE)
        kmp_reader_complain(r, node->place,
                            "output %s: joint '%s' is in the tree and has no multipliers: only a cut joint has", word,
                            name);
    else
        kmp_reader_complain_near(r, node->place, &nearest, "output %s: unknown %s '%s'", word, list.what, name);
    return -1;
}

static bool has_components(const kempe_model *model, int force)
{
    return force >= 0 && model->forces[force].vector[0];
}

static int find_force(kmp_reader *r, const kmp_yaml *node, const char *word, const char *name)
{
    int force = find_thing(r, node, word, (things){"force", r->model->force_count, force_name}, name);
    if (has_components(r->model, force))
        kmp_reader_complain(r, node->place, "output force: '%s' is given by its components", name);
    return force;
}

/* Elastic wheels have no multiplier: the message names the right word. */
static bool is_elastic(kmp_reader *r, const kmp_yaml *node, const char *word, const char *name)
{
    const kempe_model *model = r->model;
    for (int k = 0; k < model->wheel_count; k++)
        if (strcmp(model->wheels[k].name, name) == 0 && model->wheels[k].form == KMP_CONTACT_ELASTIC) {
            kmp_reader_complain(r, node->place,
                                "output %s: wheel '%s' is elastic and has no multiplier; contact(%s) has its "
                                "normal force",
                                word, name, name);
            return true;
        }
    return false;
}

static int find_argument(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    const kempe_model *model = r->model;
    const char *what = kmp_reader_say(r, "output %s", row->word);
    switch (row->argument) {
    case KMP_OUTPUT_OF_MAYBE_COORDINATE:
        return kmp_read_motion_text(r, node->place, name, what);
    case KMP_OUTPUT_OF_MAYBE_LOOP:
    case KMP_OUTPUT_OF_LOOP:
        if (is_elastic(r, node, row->word, name))
            return -1;
        return find_thing(r, node, row->word, (things){"loop", model->closure_count, closure_name}, name);
    case KMP_OUTPUT_OF_POINT:
        return kmp_read_point_text(r, node->place, name, what);
    case KMP_OUTPUT_OF_FORCE:
        return find_force(r, node, row->word, name);
    case KMP_OUTPUT_OF_SENSOR:
        return find_thing(r, node, row->word, (things){"sensor", model->sensor_count, sensor_name}, name);
    case KMP_OUTPUT_OF_WHEEL:
        return find_thing(r, node, row->word, (things){"wheel", model->wheel_count, wheel_name}, name);
    case KMP_OUTPUT_OF_NOTHING:
        break;
    }
    return -1;
}

/* -- outputs ------------------------------------------------------------------------------------- */

/* The NAME of "word(NAME)"; NULL when `text` is not of that form. */
static const char *argument_of(kmp_reader *r, const char *text, const char *word)
{
    size_t length = strlen(text), head = strlen(word);
    if (length < head + 3 || strncmp(text, word, head) != 0 || text[head] != '(' || text[length - 1] != ')')
        return NULL;
    return kmp_reader_say(r, "%.*s", (int)(length - head - 2), text + head + 1);
}

static void complain_output(kmp_reader *r, const kmp_yaml *node)
{
    kmp_nearest nearest = kmp_nearest_begin(node->text);
    for (int i = 0; i < KMP_OUTPUT_KINDS; i++)
        kmp_nearest_offer(&nearest, kmp_output_rows[i].word);
    for (int i = 0; i < r->model->sensor_count; i++)
        kmp_nearest_offer(&nearest, r->model->sensors[i].name);
    kmp_reader_complain_near(
        r, node->place, &nearest,
        "unknown output '%s'; available: q, qd, qdd, lambda, energy, q(JOINT), angle(JOINT), qd(JOINT), qdd(JOINT), "
        "lambda(LOOP), reaction(LOOP), position(BODY.POINT), velocity(BODY.POINT), acceleration(BODY.POINT), "
        "force(FORCE), sensor(SENSOR), contact(WHEEL)",
        node->text);
}

static bool stands_alone(kmp_output_argument argument)
{
    return argument == KMP_OUTPUT_OF_NOTHING || argument == KMP_OUTPUT_OF_MAYBE_COORDINATE ||
           argument == KMP_OUTPUT_OF_MAYBE_LOOP;
}

static bool read_word(kmp_reader *r, const char *text, kmp_output *output)
{
    for (int i = 0; i < KMP_OUTPUT_KINDS; i++)
        if (stands_alone(kmp_output_rows[i].argument) && strcmp(kmp_output_rows[i].word, text) == 0) {
            *output = (kmp_output){(kmp_output_kind)i, -1};
            return true;
        }
    for (int i = 0; i < r->model->sensor_count; i++)
        if (strcmp(r->model->sensors[i].name, text) == 0) {
            *output = (kmp_output){KMP_OUTPUT_SENSOR, i};
            return true;
        }
    return false;
}

static void read_output(kmp_reader *r, const kmp_yaml *node, kmp_output *output)
{
    const char *text = kmp_read_word(r, node, "an output");
    if (!text || read_word(r, text, output))
        return;
    for (int i = 0; i < KMP_OUTPUT_KINDS; i++) {
        const kmp_output_row *row = &kmp_output_rows[i];
        const char *name = row->argument == KMP_OUTPUT_OF_NOTHING ? NULL : argument_of(r, text, row->word);
        if (!name && i == KMP_OUTPUT_Q)
            name = argument_of(r, text, "angle");
        if (name) {
            *output = (kmp_output){(kmp_output_kind)i, find_argument(r, node, row, name)};
            return;
        }
    }
    complain_output(r, node);
}

static void use_default_outputs(kempe_model *model)
{
    model->outputs = KMP_ARENA_NEW(&model->arena, kmp_output, KMP_OUTPUT_LAMBDA + 1);
    for (int i = 0; model->outputs && i <= KMP_OUTPUT_LAMBDA; i++)
        model->outputs[model->output_count++] = (kmp_output){(kmp_output_kind)i, -1};
}

void kmp_read_outputs(kmp_reader *r, const kmp_yaml *list)
{
    kempe_model *model = r->model;
    if (!list) {
        use_default_outputs(model);
        return;
    }
    if (!kmp_read_list(r, list, "run outputs", -1))
        return;
    model->outputs = KMP_ARENA_NEW(&model->arena, kmp_output, list->count);
    for (int i = 0; model->outputs && i < list->count; i++)
        read_output(r, list->items[i], &model->outputs[model->output_count++]);
}
