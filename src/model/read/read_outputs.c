/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensors, which are named expressions, and the outputs of a run: the rows of output_kinds.def. */
#include "model/read/read_outputs.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "model/read/segments.h"
#include <stdlib.h>
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

/* True for a loop or a contact whose force an error has left out: forces of both are added last. */
static bool is_left_out(const kmp_reader *r, const char *name)
{
    return r->wrong && (kmp_yaml_get(kmp_yaml_get(r->root, "loops"), name) ||
                        kmp_yaml_get(kmp_yaml_get(r->root, "contacts"), name));
}

static int find_thing(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    static const char *const kinds[] = {[KMP_OUTPUT_OF_MAYBE_LOOP] = "loop",   [KMP_OUTPUT_OF_LOOP] = "loop",
                                        [KMP_OUTPUT_OF_MAYBE_STATE] = "state", [KMP_OUTPUT_OF_FORCE] = "force",
                                        [KMP_OUTPUT_OF_OUTLINED] = "contact",  [KMP_OUTPUT_OF_SENSOR] = "sensor",
                                        [KMP_OUTPUT_OF_WHEEL] = "wheel",       [KMP_OUTPUT_OF_TYRE] = "tyre",
                                        [KMP_OUTPUT_OF_BEARING] = "bearings",  [KMP_OUTPUT_OF_ROPE] = "rope",
                                        [KMP_OUTPUT_OF_SHEAVE] = "rope"};
    const char *kind = kinds[row->argument];
    const kmp_output_argument of = row->argument == KMP_OUTPUT_OF_SHEAVE ? KMP_OUTPUT_OF_ROPE : row->argument;
    kmp_name_list names = kmp_output_names(r->model, of);
    int found = kmp_name_find(names, name);
    if (found >= 0)
        return found;
    kmp_nearest nearest = kmp_nearest_of(name, names);
    if (strcmp(kind, "loop") == 0 && kmp_joint_find(r->model, name) >= 0)
        kmp_reader_complain(r, node->place,
                            "output %s: joint '%s' is in the tree and has no multipliers; reaction(%s) and moment(%s) "
                            "are its load, and 'cut: yes' makes it a closure",
                            row->word, name, name, name);
    else if (strcmp(kind, "force") != 0 || !is_left_out(r, name))
        kmp_reader_complain_unknown(r, node->place, &nearest, "output %s: unknown %s '%s'", row->word, kind, name);
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

/* The kind for a joint of the tree in place of the kind for a loop of no such name, and for a coordinate of a cut
 * joint. */
static kmp_output_kind kind_for(const kmp_reader *r, kmp_output_kind kind, const char *name)
{
    const int found = kmp_name_find(KMP_NAMED(r->model, closure), name);
    const bool on_cam = found >= 0 && r->model->closures[found].cam;
    if (kind == KMP_OUTPUT_FORCE && on_cam)
        return KMP_OUTPUT_CAM_FORCE;
    if (kind == KMP_OUTPUT_PRESSURE_ANGLE || kind == KMP_OUTPUT_CURVATURE)
        return on_cam ? kind : KMP_OUTPUT_TOUCH_PRESSURE_ANGLE + (kind - KMP_OUTPUT_PRESSURE_ANGLE);
    if (kind <= KMP_OUTPUT_QDD && kmp_cut_coordinate_find(r->model, name) >= 0)
        return KMP_OUTPUT_CUT_Q + kind - KMP_OUTPUT_Q;
    if (kind == KMP_OUTPUT_CONTACT && kmp_name_find(KMP_NAMED(r->model, tyre), name) >= 0)
        return KMP_OUTPUT_TYRE_CONTACT;
    if (kind == KMP_OUTPUT_FORCE || kind == KMP_OUTPUT_GAP) {
        const bool outlined = kmp_name_find(KMP_NAMED(r->model, outline_contact), name) >= 0;
        return !outlined ? kind : kind == KMP_OUTPUT_FORCE ? KMP_OUTPUT_OUTLINE_FORCE : KMP_OUTPUT_OUTLINE_GAP;
    }
    bool loop = kmp_output_rows[kind].argument == KMP_OUTPUT_OF_LOOP;
    if (!loop || kmp_name_find(KMP_NAMED(r->model, closure), name) >= 0 || kmp_joint_find(r->model, name) < 0)
        return kind;
    return kind == KMP_OUTPUT_MOMENT ? KMP_OUTPUT_JOINT_MOMENT : KMP_OUTPUT_JOINT_REACTION;
}

/* ROPE.k: a sheave of its path. */
static void read_sheave(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name,
                        kmp_output *output)
{
    const char *dot = strrchr(name, '.');
    const int found = find_thing(r, node, row, kmp_reader_say(r, "%.*s", (int)(dot ? dot - name : 0), name));
    const int place = dot ? (int)strtol(dot + 1, NULL, 10) : 0;
    if (found < 0)
        return;
    const kmp_rope *rope = &r->model->ropes[found];
    if (rope->count > 0 && (place < 1 || place > rope->count || !kmp_rope_wraps(rope, place - 1)))
        kmp_reader_complain(r, node->place,
                            "output %s: '%s' has no sheave between two other places at number %d of its path",
                            row->word, rope->name, place);
    output->index = found;
    output->about = place;
}

/* Outputs that only flexible bodies have. */
static void check_flexible_output(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, int point)
{
    const kmp_output_kind kind = (kmp_output_kind)(row - kmp_output_rows);
    const kmp_point *p = &r->model->points[point];
    const kmp_body *body = &r->model->bodies[p->body];
    const char *obstacle = kmp_output_obstacle(r->model, kind, point);
    const char *divided = obstacle ? kmp_segments_name(r, p->body) : NULL;
    if (divided)
        kmp_reader_complain(r, node->place,
                            "output %s: body '%s' is divided into rigid segments, which have none: take 'position' of "
                            "its points, or 'reaction' and 'moment' of the joints between segments, such as "
                            "'moment(%s_1)'",
                            row->word, divided, divided);
    else if (obstacle)
        kmp_reader_complain(r, node->place, "output %s: body '%s' %s", row->word, body->name, obstacle);
}

/* Outputs that only followers on cams have. */
static bool check_cam_output(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, int found)
{
    const kmp_output_kind kind = (kmp_output_kind)(row - kmp_output_rows);
    const kempe_model *model = r->model;
    const bool touches = kind == KMP_OUTPUT_TOUCH_PRESSURE_ANGLE || kind == KMP_OUTPUT_TOUCH_CURVATURE;
    const bool follows =
        kind == KMP_OUTPUT_CAM_FORCE || kind == KMP_OUTPUT_PRESSURE_ANGLE || kind == KMP_OUTPUT_CURVATURE;
    if (!touches && !follows)
        return true;
    const struct kmp_cam_follower *cam = touches ? model->forces[found].touch.side[1].cam : model->closures[found].cam;
    const int point = touches ? model->forces[found].touch.side[0].point : model->closures[found].point[1];
    if (!cam)
        return kmp_reader_complain(r, node->place, "output %s: '%s' is not a follower on a cam", row->word,
                                   touches ? model->forces[found].name : model->closures[found].name);
    const kmp_body *body = &model->bodies[model->points[point].body];
    if ((kind == KMP_OUTPUT_PRESSURE_ANGLE || kind == KMP_OUTPUT_TOUCH_PRESSURE_ANGLE) && body->motion_count != 1)
        return kmp_reader_complain(
            r, node->place,
            "output %s: body '%s' has %d coordinates: the direction of a follower is known where "
            "its body has one",
            row->word, body->name, body->motion_count);
    return true;
}

static int find_argument(kmp_reader *r, const kmp_yaml *node, const kmp_output_row *row, const char *name)
{
    const char *what = kmp_reader_say(r, "output %s", row->word);
    if (row->argument == KMP_OUTPUT_OF_MAYBE_COORDINATE)
        return kmp_read_motion_text(r, node->place, name, what);
    if (row->argument == KMP_OUTPUT_OF_CUT)
        return kmp_cut_coordinate_find(r->model, name);
    if (row->argument == KMP_OUTPUT_OF_POINT) {
        const int point = kmp_read_point_text(r, node->place, name, what);
        if (point >= 0)
            check_flexible_output(r, node, row, point);
        return point;
    }
    if (row->argument == KMP_OUTPUT_OF_JOINT) { /* a joint of the tree, less one */
        const int body = kmp_joint_find(r->model, name);
        const char *obstacle = kmp_joint_obstacle(r->model, body);
        if (obstacle)
            kmp_complain_of(r, node, what, "the load of joint '%s' is not known: %s", name, obstacle);
        return body - 1;
    }
    bool loop = row->argument == KMP_OUTPUT_OF_MAYBE_LOOP || row->argument == KMP_OUTPUT_OF_LOOP;
    if (loop && is_elastic(r, node, row->word, name))
        return -1;
    int found = find_thing(r, node, row, name);
    const bool least = row == &kmp_output_rows[KMP_OUTPUT_OUTLINE_GAP] && found >= 0;
    if (least && r->model->forces[r->model->outline_contacts[found].first].kind != KMP_FORCE_TOUCH)
        kmp_reader_complain(r, node->place, "output gap: '%s' is not a rigid contact", name);
    if (found >= 0 && !check_cam_output(r, node, row, found))
        return -1;
    bool gap = row == &kmp_output_rows[KMP_OUTPUT_GAP];
    if (gap && found >= 0 && r->model->forces[found].kind != KMP_FORCE_TOUCH)
        kmp_reader_complain(r, node->place, "output gap: '%s' is not a rigid contact", name);
    else if (row->argument == KMP_OUTPUT_OF_FORCE && found >= 0 && kmp_force_has_components(&r->model->forces[found]))
        kmp_reader_complain(r, node->place,
                            "output force: '%s' is given by components: give them names under "
                            "'algebraic', and request sensors of these names",
                            name);
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

static bool is_unknown(const kempe_model *model, const char *name)
{
    bool is = false;
    for (int i = 0; i < model->unknowns_count; i++)
        is = is || kmp_name_find(kmp_unknown_names(&model->unknowns[i]), name) >= 0;
    return is;
}

static void complain_output(kmp_reader *r, const kmp_yaml *node)
{
    if (is_unknown(r->model, node->text)) {
        kmp_reader_complain(r, node->place,
                            "unknown output '%s'; it is a name of 'algebraic': with sensors: {%s: %s} it is an output",
                            node->text, node->text, node->text);
        return;
    }
    kmp_nearest nearest = kmp_nearest_of(node->text, KMP_NAMES_OF(kmp_output_rows));
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, sensor));
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, state));
    kmp_reader_complain_unknown(
        r, node->place, &nearest,
        "unknown output '%s'; available: q, qd, qdd, lambda, energy, q(JOINT), angle(JOINT), qd(JOINT), qdd(JOINT), "
        "lambda(LOOP), reaction(LOOP), reaction(JOINT), bearing(BEARINGS), position(BODY.POINT), velocity(BODY.POINT), "
        "acceleration(BODY.POINT), "
        "force(FORCE), gap(CONTACT), tension(ROPE), length(ROPE), wrap(ROPE.k), sensor(SENSOR), contact(WHEEL), "
        "momentum(BODY), angular_momentum(BODY)",
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
            else if (row->argument == KMP_OUTPUT_OF_SHEAVE)
                read_sheave(r, node, row, name, output);
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
            model->outputs[model->output_count++] =
                (kmp_output){.kind = (kmp_output_kind)i, .index = -1, .unasked = true};
        return;
    }
    if (!kmp_read_list(r, list, "run outputs", -1))
        return;
    model->outputs = KMP_ARENA_NEW(&model->arena, kmp_output, list->count);
    for (int i = 0; model->outputs && i < list->count; i++)
        read_output(r, list->items[i], &model->outputs[model->output_count++]);
}
