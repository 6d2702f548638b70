/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels on rails: each becomes a force, and where its contact is rigid a closure, of its name. */
#include "rail/model/read_wheels.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/read/read_values.h"
#include "rail/model/read_profiles.h"
#include "rail/model/zones.h"
#include <string.h>

static const kmp_key wheel_keys[] = {
#include "model/keys/wheel_keys.def"
    {0}};

/* A wheel being read. */
typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_wheel *wheel;
} reading;

/* -- words --------------------------------------------------------------------------------------- */

/* One of a list's words; `number` is unchanged after an error. */
static bool read_choice(const reading *w, const char *key, kmp_name_list words, int *number)
{
    const kmp_yaml *node = kmp_yaml_get(w->map, key);
    if (!node)
        return true;
    if (!kmp_read_word(w->r, node, kmp_reader_say(w->r, "%s of %s", key, w->what)))
        return false;
    int found = kmp_read_choice(w->r, node, w->what, words, kmp_reader_say(w->r, "%s is", key), " or ");
    *number = found < 0 ? *number : found;
    return found >= 0;
}

/* TRACK.left or TRACK.right */
static bool read_rail(const reading *w, const kmp_yaml *node)
{
    kmp_reader *r = w->r;
    const char *word = kmp_read_word(r, node, w->what), *dot = word ? strrchr(word, '.') : NULL;
    int side = dot ? kmp_name_find(KMP_NAMES(kmp_track_side_words, KMP_TRACK_SIDES), dot + 1) : -1;
    if (!word)
        return false;
    if (side < 0)
        return kmp_reader_complain(r, node->place, "%s: a rail is TRACK.left or TRACK.right, not '%s'", w->what, word);
    w->wheel->side = (kmp_track_side)side;
    kmp_yaml name = *node;
    name.text = kmp_reader_say(r, "%.*s", (int)(dot - word), word);
    int track = kmp_read_reference(r, &name, w->what, "track", KMP_NAMED(r->model, track));
    w->wheel->track = track < 0 ? 0 : track;
    return track >= 0;
}

static bool read_centre(const reading *w, const kmp_yaml *node)
{
    w->wheel->point = kmp_read_point(w->r, node, w->what);
    if (w->wheel->point < 0)
        return false;
    if (w->r->model->points[w->wheel->point].body > 0)
        return true;
    return kmp_reader_complain(w->r, node->place,
                               "%s: a wheel is at a point of a body that rotates with it, not of the ground", w->what);
}

/* -- numbers ------------------------------------------------------------------------------------- */

static bool read_poisson(const reading *w)
{
    double *poisson = &w->wheel->poisson;
    (void)kmp_key_default(wheel_keys, "poisson", 1, poisson);
    const kmp_yaml *node = kmp_yaml_get(w->map, "poisson");
    if (!node)
        return true;
    if (!kmp_read_fixed(w->r, node, kmp_reader_say(w->r, "poisson of %s", w->what),
                        kmp_key_dimension(wheel_keys, "poisson"), poisson))
        return false;
    if (*poisson >= 0 && *poisson <= 0.5)
        return true;
    return kmp_reader_complain(w->r, node->place, "%s: poisson must be between 0 and 0.5, not %.6g", w->what, *poisson);
}

static bool read_numbers(const reading *w)
{
    kmp_wheel *wheel = w->wheel;
    bool good = kmp_read_required(w->r, w->map, w->what, "radius");
    wheel->has_stiffness = kmp_yaml_get(w->map, "stiffness");
    for (int k = 0; k < KMP_WHEEL_FIELDS; k++) {
        const kmp_wheel_field *field = &kmp_wheel_fields[k];
        const kmp_yaml *node = kmp_yaml_get(w->map, field->key);
        const char *name = kmp_reader_say(w->r, "the %s of %s", field->key, w->what);
        kmp_number *number = (kmp_number *)(void *)((char *)wheel + field->offset);
        (void)kmp_key_default(wheel_keys, field->key, 1, &number->value);
        if (node)
            good = kmp_read_number(w->r, node, name, kmp_key_dimension(wheel_keys, field->key), number) &&
                   kmp_check_rule(w->r, node, name, field->rule, number->value, "") && good;
    }
    return read_poisson(w) && good;
}

/* Reports keys that a rigid wheel does not use. */
static bool check_form(const reading *w)
{
    static const char *const elastic[] = {"stiffness", "damping"};
    bool good = true;
    for (int k = 0; k < 2 && w->wheel->form == KMP_CONTACT_RIGID; k++) {
        const kmp_yaml *node = kmp_yaml_get(w->map, elastic[k]);
        if (node)
            kmp_reader_complain(w->r, node->place, "%s: the key '%s' belongs to an elastic contact", w->what,
                                elastic[k]);
        good = good && !node;
    }
    return good;
}

/* -- zones --------------------------------------------------------------------------------------- */

static bool read_zone(const reading *w, const kmp_yaml *node, int k, double (*zone)[2])
{
    const char *what = kmp_reader_say(w->r, "zone %d of %s", k + 1, w->what);
    if (!kmp_read_list(w->r, node, what, 2))
        return false;
    for (int i = 0; i < 2; i++)
        if (!kmp_read_fixed(w->r, node->items[i], what, kmp_key_dimension(wheel_keys, "zones"), &zone[k][i]))
            return false;
    if (zone[k][0] < zone[k][1] && (k == 0 || zone[k][0] >= zone[k - 1][1]))
        return true;
    return kmp_reader_complain(w->r, node->place, "%s is from %.6g to %.6g: zones must increase without overlap", what,
                               zone[k][0], zone[k][1]);
}

static bool read_zones(const reading *w)
{
    kmp_wheel *wheel = w->wheel;
    const kmp_yaml *list = kmp_yaml_get(w->map, "zones");
    if (!list)
        return true;
    if (!kmp_read_list(w->r, list, kmp_reader_say(w->r, "zones of %s", w->what), -1))
        return false;
    if (list->count < 1 || list->count > KMP_WHEEL_ZONES)
        return kmp_reader_complain(w->r, list->place, "%s: a wheel has 1 to %d zones, not %d", w->what, KMP_WHEEL_ZONES,
                                   list->count);
    bool good = true;
    for (int k = 0; k < list->count; k++)
        good = read_zone(w, list->items[k], k, wheel->zone) && good;
    wheel->zone_count = list->count;
    return good;
}

static bool has_same_shape(const kmp_wheel *a, const kmp_wheel *b)
{
    return a->track == b->track && a->profile == b->profile && a->radius.value == b->radius.value;
}

/* Copies the zones of an equal earlier wheel, or finds them. */
static void find_zones(const reading *w)
{
    const kempe_model *model = w->r->model;
    kmp_wheel *wheel = w->wheel;
    for (const kmp_wheel *other = model->wheels; other < wheel; other++)
        if (has_same_shape(other, wheel) && other->zone_count > 0 && other->form == wheel->form &&
            !other->zones_given) {
            wheel->zone_count = other->zone_count;
            memcpy(wheel->zone, other->zone, sizeof wheel->zone);
            return;
        }
    int zones = kmp_zones_find(&model->tracks[wheel->track], wheel);
    if (zones == 0)
        w->r->scratch.failed = true;
    if (zones > KMP_WHEEL_ZONES) {
        const kmp_place place = w->wheel->place;
        kmp_log(
            w->r->context, KEMPE_LOG_WARNING,
            "%s:%d:%d: %s would touch its rail in %d zones, and a wheel has at most %d: the borders with the smallest "
            "jumps are omitted, and the contact may jump there; use a smoother profile, or give 'zones'",
            w->r->model->files[place.file], place.line, place.column, w->what, zones, KMP_WHEEL_ZONES);
    }
}

/* Copies the places of an equal earlier wheel's zones, or finds them. */
static void space_zones(const reading *w)
{
    const kempe_model *model = w->r->model;
    kmp_wheel *wheel = w->wheel;
    for (const kmp_wheel *other = model->wheels; other < wheel; other++)
        if (other->track == wheel->track && other->profile == wheel->profile && other->form == wheel->form &&
            other->radius.value == wheel->radius.value && other->zone_count == wheel->zone_count &&
            memcmp(other->zone, wheel->zone, sizeof wheel->zone) == 0) {
            memcpy(wheel->node, other->node, sizeof wheel->node);
            memcpy(wheel->nodes_end, other->nodes_end, sizeof wheel->nodes_end);
            memcpy(wheel->least_spread, other->least_spread, sizeof wheel->least_spread);
            return;
        }
    if (!kmp_zones_space(&model->tracks[wheel->track], wheel))
        w->r->scratch.failed = true;
}

/* -- the whole ----------------------------------------------------------------------------------- */

static void read_wheel(const reading *w)
{
    kmp_reader *r = w->r;
    kmp_wheel *wheel = w->wheel;
    int form = KMP_CONTACT_ELASTIC, law = KMP_CREEP_POLACH;
    if (!kmp_read_map(r, w->map, w->what, wheel_keys))
        return;
    const kmp_yaml *on = kmp_read_required(r, w->map, w->what, "on"), *at = kmp_read_required(r, w->map, w->what, "at"),
                   *profile = kmp_read_required(r, w->map, w->what, "profile");
    bool good = on && read_rail(w, on);
    good = at && read_centre(w, at) && good;
    wheel->profile = profile ? kmp_read_profile(r, profile, w->what) : NULL;
    good = wheel->profile && wheel->profile->height && good;
    good = read_choice(w, "contact", KMP_NAMES(kmp_contact_form_words, KMP_CONTACT_ELASTIC + 1), &form) && good;
    good = read_choice(w, "creep", KMP_NAMES(kmp_creep_law_words, KMP_CREEP_LAWS), &law) && good;
    wheel->form = (kmp_contact_form)form;
    wheel->law = (kmp_creep_law)law;
    good = check_form(w) && good;
    good = read_numbers(w) && good;
    wheel->zones_given = kmp_yaml_get(w->map, "zones");
    good = read_zones(w) && good;
    if (!good || !r->model->tracks[wheel->track].rail)
        return;
    wheel->scale = kmp_zones_scale(wheel);
    /* Sets the neutral position: that of an earlier wheel of the same shape, or finds it. */
    const kempe_model *model = w->r->model;
    const kmp_wheel *other = model->wheels;
    while (other < wheel && !(other->scale > 0 && has_same_shape(other, wheel)))
        other++;
    wheel->stands = other < wheel ? other->stands : kmp_zones_stand(&model->tracks[wheel->track], wheel);
    if (!wheel->zones_given)
        find_zones(w);
    if (wheel->form == KMP_CONTACT_ELASTIC)
        space_zones(w);
}

void kmp_read_wheels(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "wheels", "wheel");
    model->wheels = KMP_ARENA_NEW(&model->arena, kmp_wheel, s.count);
    while (model->wheels && kmp_section_next(&s)) {
        kmp_wheel *wheel = &model->wheels[model->wheel_count++];
        *wheel = (kmp_wheel){.name = s.name, .place = s.key->place, .point = -1, .closure = -1, .force = -1};
        read_wheel(&(reading){r, s.node, s.what, wheel});
    }
}

static void complain_name(kmp_reader *r, const kmp_wheel *wheel, const char *other)
{
    kmp_reader_complain(r, wheel->place, "a wheel cannot have the name '%s' of a %s: its own has the name of the wheel",
                        wheel->name, other);
}

void kmp_add_wheel_closures(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int k = 0; k < model->wheel_count; k++) {
        kmp_wheel *wheel = &model->wheels[k];
        if (wheel->form != KMP_CONTACT_RIGID)
            continue;
        if (kmp_name_find(KMP_NAMED(model, closure), wheel->name) >= 0)
            complain_name(r, wheel, "loop");
        wheel->closure = model->closure_count++;
        model->closures[wheel->closure] = (kmp_closure){.name = wheel->name,
                                                        .kind = KMP_CLOSURE_wheel,
                                                        .place = wheel->place,
                                                        .point = {-1, -1},
                                                        .motion = -1,
                                                        .wheel = k};
    }
}

void kmp_add_wheel_forces(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int k = 0; k < model->wheel_count; k++) {
        kmp_wheel *wheel = &model->wheels[k];
        if (kmp_name_find(KMP_NAMED(model, force), wheel->name) >= 0)
            complain_name(r, wheel, "force");
        wheel->force = model->force_count++;
        model->forces[wheel->force] =
            (kmp_force){.name = wheel->name, .kind = KMP_FORCE_WHEEL, .place = wheel->place, .motion = -1, .wheel = k};
    }
}
