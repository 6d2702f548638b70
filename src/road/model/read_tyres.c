/* SPDX-License-Identifier: BSD-3-Clause */
/* Roads and tyres. A tyre becomes a force of its name; the height of its road is one of the force's expressions, read
 * again for each tyre, because conditions belong to an expression at one place. */
#include "road/model/read_tyres.h"
#include "base/arena.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/read/read_include.h"
#include "model/read/read_states.h"
#include "model/read/read_values.h"
#include "road/model/tir_file.h"
#include <string.h>

static const kmp_key road_keys[] = {
#include "road/keys/road_keys.def"
    {0}};
static const kmp_key tyre_keys[] = {
#include "road/keys/tyre_keys.def"
    {0}};

/* -- roads ------------------------------------------------------------------------------------------- */

/* The height, or the name of a table over x. */
static const kmp_expr *read_height(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    kmp_yaml called = *node;
    const char *name = node->text ? kmp_reader_name(r, node->place.file, node->text) : "";
    if (kmp_name_find(KMP_NAMED(r->model, table), name) >= 0)
        called.text = kmp_reader_say(r, "%s(x)", node->text);
    return kmp_read_expr(r, &called, kmp_reader_say(r, "height of %s", what), kmp_key_dimension(road_keys, "height"),
                         KMP_OF_X);
}

static void read_road(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_road *road)
{
    if (!kmp_read_map(r, map, what, road_keys))
        return;
    const kmp_yaml *flat = kmp_yaml_get(map, "flat"), *at = kmp_yaml_get(map, "at"),
                   *height = kmp_yaml_get(map, "height"), *friction = kmp_yaml_get(map, "friction");
    const bool along = kmp_yaml_get(map, "along");
    if ((flat && (at || height)) || (!flat && !(at && height))) {
        kmp_reader_complain(r, map->place, "%s has 'flat', the point of a plane, or 'at' with a 'height'", what);
        return;
    }
    road->normal = 2;
    bool good = kmp_read_word_of(r, map, what, "normal", kmp_axis_letters, &road->normal);
    road->along = road->normal == 0 ? 1 : 0;
    good = kmp_read_word_of(r, map, what, "along", kmp_axis_letters, &road->along) && good;
    if (along && road->along == road->normal)
        good = kmp_complain_of(r, map, what, "its height cannot change along %s, its normal",
                               kmp_name_at(kmp_axis_letters, road->normal));
    road->friction = (kmp_number){.value = 1};
    if (!friction)
        road->friction.symbol = ++r->model->symbol_count;
    if (friction)
        good = kmp_read_ruled(r, friction, kmp_reader_say(r, "friction of %s", what), KMP_DIM_NUMBER,
                              KMP_FIELD_POSITIVE, &road->friction) &&
               good;
    road->height = height ? read_height(r, height, what) : NULL;
    good = good && (!height || road->height);
    const int point = kmp_read_point(r, flat ? flat : at, what);
    road->point = good ? point : -1;
}

/* -- tyres ------------------------------------------------------------------------------------------- */

/* A tyre being read. */
typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_tyre *tyre;
    kmp_tir_file tir;
} reading;

static bool read_places(const reading *t)
{
    kmp_reader *r = t->r;
    const kmp_yaml *on = kmp_read_required(r, t->map, t->what, "on"), *at = kmp_read_required(r, t->map, t->what, "at");
    const int road = on ? kmp_read_reference(r, on, t->what, "road", KMP_NAMED(r->model, road)) : -1;
    const int point = at ? kmp_read_point(r, at, t->what) : -1;
    if (road < 0 || point < 0)
        return false;
    t->tyre->road = road;
    t->tyre->point = point;
    const kmp_body *body = &r->model->bodies[r->model->points[point].body];
    if (body == r->model->bodies)
        return kmp_complain_of(r, at, t->what,
                               "a tyre is at a point of a body that rotates with it, not of the ground");
    return !body->flexible ||
           kmp_complain_of(r, at, t->what, "a tyre is at a point of a rigid body, and '%s' is flexible", body->name);
}

/* Once for each file. */
static void warn_of_unused(const reading *t, const kmp_yaml *file)
{
    const int more = t->tir.unused_count - KMP_TIR_FIRST_UNUSED;
    if (t->tir.unused_count == 0)
        return;
    for (const kmp_tyre *other = t->r->model->tyres; other < t->tyre; other++)
        if (other->file && strcmp(other->file, file->text) == 0)
            return;
    kmp_reader_warn(t->r, file->place, "%s: the equations do not use %d key%s of '%s': %s%s", t->what,
                    t->tir.unused_count, t->tir.unused_count == 1 ? "" : "s", file->text, t->tir.unused,
                    more > 0 ? kmp_reader_say(t->r, " and %d more", more) : "");
}

/* The file, or the brush model. */
static bool read_source(reading *t)
{
    static const char *const models[] = {"brush"};
    const kmp_yaml *file = kmp_yaml_get(t->map, "file"), *model = kmp_yaml_get(t->map, "model");
    int choice = 0;
    if (!file == !model)
        return kmp_reader_complain(t->r, t->map->place, "%s has a 'file' (.tir), or 'model: brush'", t->what);
    if (model)
        return kmp_read_word_of(t->r, t->map, t->what, "model", KMP_NAMES_OF(models), &choice);
    if (!kmp_tir_read(t->r, file, t->what, &t->tir))
        return false;
    t->tyre->form = t->tir.form;
    t->tyre->tangent = t->tir.form == KMP_TYRE_MF61;
    double *kept = KMP_ARENA_NEW(&t->r->model->arena, double, KMP_TIR_COUNT);
    t->tyre->file = kmp_arena_strdup(&t->r->model->arena, file->text);
    if (kept)
        memcpy(kept, t->tir.value, sizeof t->tir.value);
    t->tyre->tir = kept;
    warn_of_unused(t, file);
    return kept && t->tyre->file;
}

/* Keys that do not belong to the model are errors. */
static bool check_keys(const reading *t)
{
    static const char *const of_brush[] = {"tread_stiffness", "half_length", "rolling_resistance"};
    static const char *const of_file[] = {"side", "slip_angle"};
    const bool brush = t->tyre->form == KMP_TYRE_BRUSH;
    bool good = true;
    for (int k = 0; k < (brush ? 2 : 3); k++) {
        const char *key = brush ? of_file[k] : of_brush[k];
        const kmp_yaml *node = kmp_yaml_get(t->map, key);
        if (node)
            good = KMP_COMPLAIN(t, node, "the key '%s' belongs to %s", key,
                                brush ? "a tyre with a file" : "'model: brush'");
    }
    static const char *const needed[] = {"radius", "vertical_stiffness", "friction", "tread_stiffness", "half_length"};
    for (int k = 0; brush && k < 5; k++)
        good = kmp_read_required(t->r, t->map, t->what, needed[k]) && good;
    return good;
}

static bool read_numbers(const reading *t)
{
    kmp_tyre *tyre = t->tyre;
    const struct {
        int field, tir;
    } from_file[] = {{KMP_TYRE_radius, KMP_TIR_UNLOADED_RADIUS},
                     {KMP_TYRE_vertical_stiffness, KMP_TIR_VERTICAL_STIFFNESS},
                     {KMP_TYRE_vertical_damping, KMP_TIR_VERTICAL_DAMPING},
                     {KMP_TYRE_low_speed, KMP_TIR_VXLOW}};
    bool good = true;
    tyre->friction.value = tyre->low_speed.value = 1;
    for (int k = 0; tyre->tir && k < 4; k++)
        ((kmp_number *)kmp_tyre_get(tyre, from_file[k].field))->value =
            tyre->tir[from_file[k].tir] * (k == 1 ? tyre->tir[KMP_TIR_LCZ] : 1);
    for (int k = 0; k < KMP_TYRE_FIELDS; k++) {
        const kmp_wheel_field *field = &kmp_tyre_fields[k];
        const kmp_yaml *node = kmp_yaml_get(t->map, field->key);
        const char *name = kmp_reader_say(t->r, "the %s of %s", field->key, t->what);
        kmp_number *number = (kmp_number *)kmp_tyre_get(tyre, k);
        if (!node && number->value != 0) /* of the file, or as it is without the key */
            number->symbol = ++t->r->model->symbol_count;
        if (node)
            good =
                kmp_read_ruled(t->r, node, name, kmp_key_dimension(tyre_keys, field->key), field->rule, number) && good;
    }
    if (good && !(tyre->vertical_stiffness.value > 0))
        good = KMP_COMPLAIN(t, t->map, "the file has no positive VERTICAL_STIFFNESS: give 'vertical_stiffness'");
    if (good && !(tyre->low_speed.value > 0))
        good = KMP_COMPLAIN(t, t->map, "VXLOW is not positive: give 'low_speed'");
    tyre->has_longitudinal_relaxation = kmp_yaml_get(t->map, "longitudinal_relaxation");
    tyre->has_lateral_relaxation = kmp_yaml_get(t->map, "lateral_relaxation");
    return good;
}

/* The mode chooses its forces, and whether its slips are transient. */
static bool read_mode(const reading *t, bool *transient)
{
    const kmp_yaml *node = kmp_yaml_get(t->map, "mode");
    double mode = t->tir.mode >= 0 && t->tyre->tir ? t->tir.mode : 4;
    if (node && !kmp_read_fixed(t->r, node, kmp_reader_say(t->r, "mode of %s", t->what), KMP_DIM_NUMBER, &mode))
        return false;
    const int number = mode >= 0 && mode < 100 ? (int)mode : -1, forces = number % 10;
    if (number != mode || forces > 4 || number >= 20)
        return KMP_COMPLAIN(t, node ? node : t->map, "the mode is 0 to 4, or 10 to 14 with transient slip, not %g%s",
                            mode, forces == 5 ? "; turn slip is not known" : "");
    kmp_tyre *tyre = t->tyre;
    tyre->along = forces == 1 || forces >= 3;
    tyre->across = forces >= 2;
    tyre->combined = forces == 4;
    int choice = number >= 10;
    if (tyre->form == KMP_TYRE_BRUSH && forces != 0 && forces != 4)
        return KMP_COMPLAIN(t, node ? node : t->map, "a brush model has the modes 0, 4, 10 and 14");
    if (!kmp_read_word_of(t->r, t->map, t->what, "transient", kmp_no_or_yes, &choice))
        return false;
    *transient = choice > 0;
    return true;
}

static bool check_relaxation(const reading *t)
{
    const kmp_tyre *tyre = t->tyre;
    const bool x = tyre->has_longitudinal_relaxation || (tyre->tir && tyre->tir[KMP_TIR_PTX1] != 0);
    const bool y = tyre->has_lateral_relaxation || (tyre->tir && tyre->tir[KMP_TIR_PTY1] != 0);
    return (x && y) ||
           KMP_COMPLAIN(t, t->map, "transient slip needs '%s'%s", x ? "lateral_relaxation" : "longitudinal_relaxation",
                        tyre->tir ? (x ? ", because the file has no PTY1" : ", because the file has no PTX1") : "");
}

/* The form of its equations is said, because implementations of the Magic Formula differ. */
static void say_form(const reading *t)
{
    const kmp_tyre *tyre = t->tyre;
    kmp_text form = {0};
    if (!tyre->tir)
        return;
    kmp_tyre_put_form(&form, tyre);
    kmp_log(t->r->context, KEMPE_LOG_INFO, "%s: %s", t->what, form.s ? form.s : "");
    kmp_text_free(&form);
}

static void read_tyre(reading *t)
{
    static const char *const sides[] = {"left", "right"}, *const angles[] = {"angle", "tangent"},
                             *const slips[] = {"kappa", "alpha"};
    kmp_tyre *tyre = t->tyre;
    bool transient = false;
    if (!kmp_read_map(t->r, t->map, t->what, tyre_keys))
        return;
    bool good = read_places(t);
    if (!read_source(t) || !check_keys(t))
        return;
    int side = t->tir.right, angle = tyre->tangent;
    good = read_numbers(t) && good;
    good = read_mode(t, &transient) && good;
    good = kmp_read_word_of(t->r, t->map, t->what, "side", KMP_NAMES_OF(sides), &side) && good;
    good = kmp_read_word_of(t->r, t->map, t->what, "slip_angle", KMP_NAMES_OF(angles), &angle) && good;
    tyre->mirrored = side != t->tir.right;
    tyre->tangent = angle;
    if (transient && good)
        good = check_relaxation(t);
    if (transient && good)
        tyre->state = t->r->model->state_count;
    for (int k = 0; k < 2 && transient && good; k++)
        kmp_reader_add_state(t->r, kmp_arena_printf(&t->r->model->arena, "%s.%s", tyre->name, slips[k]), tyre->place);
    if (good)
        say_form(t);
}

void kmp_read_tyres(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "roads", "road");
    model->roads = KMP_ARENA_NEW(&model->arena, kmp_road, s.count);
    while (model->roads && kmp_section_next(&s)) {
        kmp_road *road = &model->roads[model->road_count++];
        *road = (kmp_road){.name = s.name, .place = s.key->place, .point = -1};
        read_road(r, s.node, s.what, road);
    }
    s = kmp_read_section(r, "tyres", "tyre");
    model->tyres = KMP_ARENA_NEW(&model->arena, kmp_tyre, s.count);
    while (model->tyres && kmp_section_next(&s)) {
        kmp_tyre *tyre = &model->tyres[model->tyre_count++];
        *tyre = (kmp_tyre){.name = s.name, .place = s.key->place, .point = -1, .force = -1, .state = -1};
        read_tyre(&(reading){.r = r, .map = s.node, .what = s.what, .tyre = tyre});
    }
}

void kmp_add_tyre_forces(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_yaml *roads = kmp_yaml_get(r->root, "roads");
    for (int k = 0; k < model->tyre_count; k++) {
        kmp_tyre *tyre = &model->tyres[k];
        const kmp_road *road = &model->roads[tyre->road];
        if (kmp_name_find(KMP_NAMED(model, force), tyre->name) >= 0)
            kmp_reader_complain(r, tyre->place,
                                "a tyre cannot have the name '%s' of a force: its own has the name of the tyre",
                                tyre->name);
        tyre->force = model->force_count++;
        kmp_force *force = &model->forces[tyre->force];
        *force = (kmp_force){.name = tyre->name, .kind = KMP_FORCE_TYRE, .place = tyre->place, .motion = -1, .tyre = k};
        if (tyre->point >= 0 && road->height) /* read once more */
            force->vector[0] = read_height(r, kmp_yaml_get(roads->items[tyre->road], "height"),
                                           kmp_reader_say(r, "road '%s'", road->name));
    }
}
