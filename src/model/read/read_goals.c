/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of the start: COORDINATE: number, position(BODY.POINT): [x, y, z], or either as {value: .., weight: ..}. */
#include "model/read/read_goals.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <string.h>

static const kmp_key goal_keys[] = {
#include "model/keys/goal_keys.def"
    {0}};

/* The BODY.POINT of "position(BODY.POINT)"; NULL when the key is of another form. */
static const char *point_of(kmp_reader *r, const char *text)
{
    static const char head[] = "position(";
    size_t length = strlen(text);
    if (strncmp(text, head, sizeof head - 1) != 0 || text[length - 1] != ')')
        return NULL;
    return kmp_reader_say(r, "%.*s", (int)(length - sizeof head), text + sizeof head - 1);
}

/* The subject of the goal; false after an error. */
static bool read_subject(kmp_reader *r, const kmp_yaml *key, kmp_goal *goal)
{
    const kempe_model *model = r->model;
    const char *text = kmp_read_word(r, key, "start goals"), *point = text ? point_of(r, text) : NULL;
    *goal = (kmp_goal){.motion = -1, .point = -1, .width = point ? 3 : 1};
    if (point)
        goal->point = kmp_read_point_text(r, key->place, point, "start goals");
    else if (text)
        goal->motion = kmp_read_motion(r, key, "start goals");
    if (goal->point < 0 && goal->motion < 0)
        return false;
    if (goal->point >= 0 && model->points[goal->point].body == 0)
        kmp_reader_complain(r, key->place, "start goals: '%s' is a point of the ground, which does not move", point);
    if (goal->motion >= 0 && model->start.hold[goal->motion])
        kmp_reader_complain(r, key->place, "start goals: '%s' is held: it keeps its value and cannot have a goal",
                            text);
    return true;
}

/* True if a file that includes this one has set the goal; `said`: places of the goals so far. */
static bool is_said(kmp_reader *r, const kmp_yaml *key, const kmp_goal *goal, const kmp_place *said)
{
    const kmp_start *start = &r->model->start;
    for (int k = 0; k < start->goal_count; k++)
        if (start->goals[k].motion == goal->motion && start->goals[k].point == goal->point)
            return kmp_reader_said(r, "start goals", key, said[k]);
    return false;
}

static void read_values(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_goal *goal)
{
    kmp_dimension wanted = goal->motion < 0 ? KMP_DIM_LENGTH : kmp_motion_dimension(r->model, goal->motion, 0);
    (goal->width == 3 ? kmp_read_vector : kmp_read_number)(r, node, what, wanted, goal->value);
}

/* One weight for all components, or one for each. */
static void read_weights(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_goal *goal)
{
    bool good = (goal->width == 3 ? kmp_read_one_or_three : kmp_read_number)(
        r, node, what, kmp_key_dimension(goal_keys, "weight"), goal->weight);
    for (int k = 0; good && k < goal->width; k++)
        good = kmp_check_rule(r, node, what, KMP_FIELD_NOT_NEGATIVE, goal->weight[k].value, "");
}

void kmp_read_goals(kmp_reader *r, const kmp_yaml *map)
{
    kmp_start *start = &r->model->start;
    if (!map || !kmp_read_map(r, map, "start goals", NULL))
        return;
    start->goals = KMP_ARENA_NEW(&r->model->arena, kmp_goal, map->count);
    kmp_place *said = KMP_ARENA_NEW(&r->scratch, kmp_place, map->count);
    for (int i = 0; start->goals && said && i < map->count; i++) {
        const kmp_yaml *node = map->items[i];
        const char *name = map->keys[i]->text;
        kmp_goal goal;
        if (!read_subject(r, map->keys[i], &goal) || is_said(r, map->keys[i], &goal, said))
            continue;
        for (int k = 0; k < 3; k++)
            goal.weight[k].value = 1;
        const char *what = kmp_reader_say(r, "the goal of '%s'", name);
        if (node->kind == KMP_YAML_MAP) {
            const kmp_yaml *weight = kmp_yaml_get(node, "weight");
            kmp_read_map(r, node, what, goal_keys);
            if (weight)
                read_weights(r, weight, kmp_reader_say(r, "the weight of '%s'", name), &goal);
            node = kmp_read_required(r, node, what, "value");
        }
        if (node)
            read_values(r, node, what, &goal);
        said[start->goal_count] = map->keys[i]->place;
        start->goals[start->goal_count++] = goal;
    }
}
