/* SPDX-License-Identifier: BSD-3-Clause */
/* Start values and settings of runs. */
#include "model/read/read_run.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/run_settings.h"
#include "model/language/limits.h"
#include "model/read/read_include.h"
#include "model/read/read_linkage.h"
#include "model/read/read_outputs.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "model/read/segments.h"
#include <math.h>
#include <string.h>

/* True if an entry has no value on purpose: a null, or an empty one that withdraws a value of a file that its own file
 * includes. Entries of included files follow it. */
static bool withdraws(kmp_reader *r, const kmp_yaml *map, int entry)
{
    const kmp_yaml *own = map->keys[entry];
    if (!map->items[entry]->empty || strcmp(map->items[entry]->text, "null") == 0)
        return map->items[entry]->empty;
    if (map->keys[map->count - 1]->place.file == own->place.file)
        return false;
    const char *name = kmp_reader_name(r, own->place.file, own->text);
    bool found = false;
    for (int i = entry + 1; i < map->count && !found; i++)
        found = strcmp(kmp_reader_name(r, map->keys[i]->place.file, map->keys[i]->text), name) == 0;
    return found;
}

/* -- goals of the start ------------------------------------------------------------------------------ */

/* Goals of the start: COORDINATE: number, position(BODY.POINT): [x, y, z], or either as {value: .., weight: ..}. */

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

/* One weight for all components, or one for each. */
static void read_weights(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_goal *goal)
{
    bool good = (goal->width == 3 ? kmp_read_one_or_three : kmp_read_number)(
        r, node, what, kmp_key_dimension(goal_keys, "weight"), goal->weight);
    for (int k = 0; good && k < goal->width; k++)
        good = kmp_check_rule(r, node, what, KMP_FIELD_NOT_NEGATIVE, goal->weight[k].value, "");
}

/* Leaves out goals that are withdrawn. */
static void keep_goals(kmp_start *start, const bool *withdrawn)
{
    const int count = start->goal_count;
    start->goal_count = 0;
    for (int k = 0; k < count; k++)
        if (!withdrawn[k])
            start->goals[start->goal_count++] = start->goals[k];
}

static void read_goals(kmp_reader *r, const kmp_yaml *map)
{
    kmp_start *start = &r->model->start;
    if (!map || !kmp_read_map(r, map, "start goals", NULL))
        return;
    start->goals = KMP_ARENA_NEW(&r->model->arena, kmp_goal, map->count);
    kmp_place *said = KMP_ARENA_NEW(&r->scratch, kmp_place, map->count);
    bool *withdrawn = KMP_ARENA_NEW(&r->scratch, bool, map->count);
    for (int i = 0; start->goals && said && withdrawn && i < map->count; i++) {
        const kmp_yaml *node = map->items[i];
        const char *name = map->keys[i]->text;
        kmp_goal goal;
        if (!read_subject(r, map->keys[i], &goal) || is_said(r, map->keys[i], &goal, said))
            continue;
        for (int k = 0; k < 3; k++)
            goal.weight[k].value = 1;
        const char *what = kmp_reader_say(r, "the goal of '%s'", name);
        /* Its subject may have another text in an included file, whose goals follow. */
        withdrawn[start->goal_count] =
            node->empty &&
            (strcmp(node->text, "null") == 0 || map->keys[map->count - 1]->place.file != map->keys[i]->place.file);
        if (withdrawn[start->goal_count]) {
            said[start->goal_count] = map->keys[i]->place;
            start->goals[start->goal_count++] = goal;
            continue;
        }
        if (node->kind == KMP_YAML_MAP) {
            const kmp_yaml *weight = kmp_yaml_get(node, "weight");
            kmp_read_map(r, node, what, goal_keys);
            if (weight)
                read_weights(r, weight, kmp_reader_say(r, "the weight of '%s'", name), &goal);
            node = kmp_read_required(r, node, what, "value");
        }
        kmp_dimension wanted = goal.motion < 0 ? KMP_DIM_LENGTH : kmp_motion_dimension(r->model, goal.motion, 0);
        if (node)
            (goal.width == 3 ? kmp_read_vector : kmp_read_number)(r, node, what, wanted, goal.value);
        said[start->goal_count] = map->keys[i]->place;
        start->goals[start->goal_count++] = goal;
    }
    if (withdrawn)
        keep_goals(start, withdrawn);
}

/* -- start --------------------------------------------------------------------------------------- */

/* Values of states, also of function blocks and of included files. */
static void read_state_values(kmp_reader *r, const kmp_yaml *map)
{
    if (!map || !kmp_read_map(r, map, "start states", NULL))
        return;
    kempe_model *model = r->model;
    kmp_place *said = KMP_ARENA_NEW(&r->scratch, kmp_place, model->state_count);
    for (int i = 0; said && i < map->count; i++) {
        const kmp_yaml *key = map->keys[i];
        const char *what = kmp_reader_say(r, "start states: '%s'", key->text);
        const int k = kmp_name_find(KMP_NAMED(model, state), kmp_reader_name(r, key->place.file, key->text));
        kmp_number value = {0};
        if (k < 0) {
            const kmp_nearest nearest = kmp_nearest_of(key->text, KMP_NAMED(model, state));
            kmp_reader_complain_unknown(r, key->place, &nearest, "start states: the model has no state '%s'",
                                        key->text);
        } else if (kmp_read_number(r, map->items[i], what, KMP_DIM_ANY, &value) &&
                   !(said[k].line > 0 && kmp_reader_said(r, "start states", key, said[k]))) {
            said[k] = key->place;
            model->states[k].start = value;
            model->states[k].began = model->states[k].delayed;
            model->states[k].before = NULL;
        }
    }
}

static const kmp_key start_keys[] = {
#include "model/keys/start_keys.def"
    {0}};

/* The value of a coordinate of a cut joint. */
static void read_cut_value(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *node, const char *what, double power)
{
    int k = kmp_cut_coordinate_find(r->model, kmp_reader_name(r, key->place.file, key->text));
    kmp_cut_coordinate *c = k < 0 ? NULL : &r->model->cut_coordinates[k];
    if (!c && !r->wrong)
        kmp_complain_of(r, key, what, "joint '%s' has several coordinates: %s.1, %s.2, ..", key->text, key->text,
                        key->text);
    if (!c)
        return;
    kmp_dimension wanted = KMP_DIM(c->rotation ? 0 : 1, 0, power);
    wanted.angle = c->rotation;
    kmp_number *number = power < 0 ? &c->qd : &c->q;
    *(power < 0 ? &c->qd_given : &c->q_given) =
        kmp_read_number(r, node, kmp_reader_say(r, "%s: '%s'", what, key->text), wanted, number);
}

/* `power` of s: 0 for coordinates, -1 for rates. Returns the key that withdraws the value of each motion; NULL: none.
 */
static const kmp_yaml **read_values(kmp_reader *r, const kmp_yaml *map, const char *what, double power,
                                    kmp_number *values, bool *given)
{
    if (!map || !kmp_read_map(r, map, what, NULL))
        return NULL;
    kmp_place *said = KMP_ARENA_NEW(&r->scratch, kmp_place, r->model->motion_count);
    const kmp_yaml **withdrawn = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, r->model->motion_count);
    for (int i = 0; said && withdrawn && i < map->count; i++) {
        const kmp_yaml *key = map->keys[i];
        const char *name = kmp_reader_name(r, key->place.file, key->text);
        if (kmp_linkage_find(r, name) == KMP_LINKED_CUT) {
            read_cut_value(r, key, map->items[i], what, power);
            continue;
        }
        int motion = kmp_read_motion(r, key, what);
        const bool mentioned = motion >= 0 && (given[motion] || withdrawn[motion]);
        kmp_number value = {0};
        kmp_dimension wanted = motion < 0 ? KMP_DIM_ANY : kmp_motion_dimension(r->model, motion, power);
        if (motion >= 0 && !mentioned && withdraws(r, map, i)) {
            withdrawn[motion] = key;
            said[motion] = key->place;
            continue;
        }
        bool good = kmp_read_number(r, map->items[i], kmp_reader_say(r, "%s: '%s'", what, key->text), wanted, &value);
        if (motion < 0)
            continue;
        if (mentioned && kmp_reader_said(r, what, key, said[motion]))
            continue;
        said[motion] = key->place;
        given[motion] = true;
        if (good)
            values[motion] = value;
    }
    return withdrawn;
}

/* A coordinate that a file holds is held, unless a file that includes it withdraws its value. */
static void hold_listed(kmp_reader *r, const kmp_yaml *list, const kmp_yaml **withdrawn)
{
    kmp_start *start = &r->model->start;
    const bool good = list && kmp_read_list(r, list, "start hold", -1);
    for (int i = 0; good && i < list->count; i++) {
        const int motion = kmp_read_motion(r, list->items[i], "start hold");
        const kmp_yaml *key = motion >= 0 && withdrawn ? withdrawn[motion] : NULL;
        if (motion < 0 || (key && key->place.file != list->items[i]->place.file))
            continue;
        start->hold[motion] = true;
        if (start->undeformed)
            start->undeformed[motion] = false;
    }
}

/* Loops close only by joints: a deflection is the consequence of a motion or of loads, not of inexact guesses. */
static void hold_elastic(kmp_reader *r, const kmp_yaml *node)
{
    enum { HELD, FREE, STATIC };
    static const char *const words[] = {"held", "free", "static"};
    const int word = node ? kmp_read_choice(r, node, "start elastic", KMP_NAMES_OF(words), "the word is") : HELD;
    if (word == FREE)
        return;
    for (int k = 0; k < r->model->motion_count; k++)
        if (r->model->motions[k].elastic)
            r->model->start.hold[k] = r->model->start.qd_given[k] = true;
    kmp_segments_hold(r);
    bool *held = r->model->flexible_count > 0 || r->segmented_count > 0
                     ? KMP_ARENA_NEW(&r->model->arena, bool, r->model->motion_count)
                     : NULL;
    if (held)
        memcpy(held, r->model->start.hold, (size_t)r->model->motion_count * sizeof *held);
    r->model->start.undeformed = held;
    r->model->start.statics = held && word == STATIC;
}

/* The state at which motions begin. */
static void read_at(kmp_reader *r, const kmp_yaml *node)
{
    const char *word = node ? kmp_read_word(r, node, "start at") : NULL, *at = NULL;
    kmp_text complaint = {0};
    if (word && !kmp_start_read_at(word, &at, &complaint))
        kmp_reader_complain(r, node->place, "start at: %s", kmp_reader_take(r, &complaint));
    else if (at)
        r->model->start.at = kmp_arena_strdup(&r->model->arena, at);
}

void kmp_read_start(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_start *start = &model->start;
    int n = model->motion_count;
    KMP_ARENA_EACH(&model->arena, kmp_number, n, &start->q, &start->qd);
    KMP_ARENA_EACH(&model->arena, bool, n, &start->q_given, &start->qd_given, &start->hold);
    const kmp_yaml *map = kmp_yaml_get(r->root, "start");
    read_state_values(r, kmp_yaml_get(map, "states"));
    for (int k = 0; !model->arena.failed && k < model->state_count; k++) {
        start->qd[kmp_model_coordinates(model) + k] = model->states[k].start;
        start->qd_given[kmp_model_coordinates(model) + k] = true;
    }
    if (model->arena.failed)
        return;
    if (!map || !kmp_read_map(r, map, "start", start_keys)) {
        hold_elastic(r, NULL);
        return;
    }
    const kmp_yaml **withdrawn = read_values(r, kmp_yaml_get(map, "q"), "start q", 0, start->q, start->q_given);
    (void)read_values(r, kmp_yaml_get(map, "qd"), "start qd", -1, start->qd, start->qd_given);
    hold_elastic(r, kmp_yaml_get(map, "elastic"));
    hold_listed(r, kmp_yaml_get(map, "hold"), withdrawn);
    read_goals(r, kmp_yaml_get(map, "goals"));
    read_at(r, kmp_yaml_get(map, "at"));
    if (start->statics && start->goal_count > 0)
        kmp_reader_complain(r, kmp_yaml_get(map, "goals")->place,
                            "start: goals are met before the deformations move into balance, which moves the loops "
                            "again: take 'elastic: held' or 'free', or leave out the goals");
}

/* -- settings ------------------------------------------------------------------------------------ */

static const kmp_key run_keys[] = {
#define RUN_KEY_KEY(name, type, absent)    {#name, KMP_RUN_UNIT_##type, absent},
#define RUN_KEY_NAMES(name, type, absent)  {#name, "", absent},
#define RUN_KEY_CHOICE(name, type, absent) {#name, "", absent},
#define RUN_KEY_NO(name, type, absent)
#define KMP_RUN_OPTION(name, type, key, engine, folder, studies, commands, group, option, value, absent, ...)          \
    RUN_KEY_##key(name, type, absent)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
#include "model/keys/run_keys.def"
    {0}};

static void read_positive(kmp_reader *r, const kmp_yaml *map, const char *key, double *value)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    const char *what = kmp_reader_say(r, "run %s", key);
    kmp_number number;
    if (!node || !kmp_read_number(r, node, what, kmp_key_dimension(run_keys, key), &number))
        return;
    kmp_reader_fix_setting(r, &number);
    if (kmp_check_rule(r, node, what, KMP_FIELD_POSITIVE, number.value, ""))
        *value = number.value;
}

static void read_whole(kmp_reader *r, const kmp_yaml *map, const char *key, long *value)
{
    double number = 0;
    read_positive(r, map, key, &number);
    if (number > 0 && number <= KMP_MOST_STEPS && number == floor(number))
        *value = (long)number;
    else if (number > 0)
        kmp_reader_complain(r, kmp_yaml_get(map, key)->place, "run %s is %.6g: it must be an integer from 1 to %.0e",
                            key, number, KMP_MOST_STEPS);
}

static void check_rows(kmp_reader *r, const kmp_yaml *map)
{
    kmp_run_settings *run = &r->model->run;
    kmp_text complaint = {0};
    if (!(run->output_step > 0))
        return;
    run->every_place = kmp_yaml_get(map, "output_step")->place;
    if (!kmp_rows_fit(run->output_step, run->t_end, &complaint))
        kmp_reader_complain(r, run->every_place, "%s", kmp_reader_take(r, &complaint));
}

static void read_choice(kmp_reader *r, const kmp_yaml *map, const char *key, const char **choice)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    const char *word = node ? kmp_read_word(r, node, kmp_reader_say(r, "run %s", key)) : NULL;
    if (word)
        *choice = kmp_arena_strdup(&r->model->arena, word);
}

static int read_word(kmp_reader *r, const kmp_yaml *map, const char *key, kmp_name_list words, const char *kind)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    const char *word = node ? kmp_read_word(r, node, kmp_reader_say(r, "run %s", key)) : NULL;
    kmp_text complaint = {0};
    int found = word ? kmp_word_find(word, words, kind, &complaint) : 0;
    if (node && found == words.count)
        kmp_reader_complain(r, node->place, "%s", kmp_reader_take(r, &complaint));
    return found < words.count ? found : 0;
}

/* Coordinates, each once. */
static void read_names(kmp_reader *r, const kmp_yaml *list, const char *what, int **motions, int *count)
{
    if (!list || !kmp_read_list(r, list, what, -1))
        return;
    *motions = KMP_ARENA_NEW(&r->model->arena, int, list->count);
    for (int i = 0; *motions && i < list->count; i++) {
        int motion = kmp_read_motion(r, list->items[i], what);
        bool twice = false;
        for (int k = 0; k < *count; k++)
            twice = twice || (*motions)[k] == motion;
        if (motion >= 0 && twice)
            kmp_complain_of(r, list->items[i], what, "'%s' is given twice", list->items[i]->text);
        else if (motion >= 0)
            (*motions)[(*count)++] = motion;
    }
}

void kmp_read_run(kmp_reader *r)
{
    kmp_run_settings *run = &r->model->run;
    const kmp_yaml *map = kmp_yaml_get(r->root, "run");
    kmp_read_outputs(r, kmp_yaml_get(map, "outputs"));
    if (!map || !kmp_read_map(r, map, "run", run_keys))
        return;
#define READ(value)                          _Generic(value, double * : read_positive, long * : read_whole, const char ** : read_choice)
#define KMP_RUN_OPTION(name, type, key, ...) KMP_RUN_IF_KEY_##key(READ (&run->name)(r, map, #name, &run->name);)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    check_rows(r, map);
    run->dynamics = (kmp_dynamics)read_word(r, map, "algorithm", kmp_dynamics_words, "algorithm");
#define READ_NO(name)
#define READ_KEY(name)
#define READ_CHOICE(name)                    run->name = (kmp_##name)read_word(r, map, #name, kmp_##name##_words, "value of " #name);
#define READ_NAMES(name)                     read_names(r, kmp_yaml_get(map, #name), "run " #name, &run->name, &run->name##_count);
#define KMP_RUN_OPTION(name, type, key, ...) READ_##key(name)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    /* One condition, or a list of them. */
    const kmp_yaml *node = kmp_yaml_get(map, "until");
    bool several = node && node->kind == KMP_YAML_LIST;
    int count = !node ? 0 : several ? node->count : 1;
    if (node)
        run->until_place = node->place;
    run->until = KMP_ARENA_NEW(&r->model->arena, const kmp_expr *, count);
    for (int i = 0; run->until && i < count; i++) {
        const kmp_yaml *item = several ? node->items[i] : node;
        const kmp_expr *e = kmp_read_expr(r, item, "run until", KMP_DIM_ANY, KMP_COMPARISON);
        if (e)
            run->until[run->until_count++] = e;
    }
}
