/* SPDX-License-Identifier: BSD-3-Clause */
/* Ropes become closures, contacts and friction before the model is read, by measures of their paths: the slack
 * free_length - length is zero in a closure, not negative in a rigid contact, and minus the depth of a contact with a
 * law. A rope with a force of both signs is this force along its length. Friction on a sheave has the levels of
 * Eytelwein and Euler for both directions, of the tension T behind it: (exp(mu w) - 1) T where the rope slides towards
 * its first end, and (1 - exp(-mu w)) T where it slides to the other.
 */
#include "model/read/rope_elements.h"
#include "model/files/nodes.h"
#include "model/read/read_include.h"
#include <string.h>

/* A rope: its name as texts in its file have it. */
typedef struct rope {
    kmp_entry_owner entries;
    const kmp_yaml *map, *along;
    const char *own;
} rope;

static const kmp_yaml *word(kmp_reader *r, kmp_place place, const char *text)
{
    return kmp_yaml_word(&r->scratch, place, text);
}

static void add_entry(const rope *own, const char *section, const char *name, const kmp_yaml *entry)
{
    kmp_add_own_entry(&own->entries, "own element", section, name, own->entries.key->place, entry);
}

static const char *text_of(const rope *own, const char *key)
{
    const kmp_yaml *node = kmp_yaml_get(own->map, key);
    return node && node->kind == KMP_YAML_SCALAR && !node->empty ? node->text : NULL;
}

static bool is_elastic(const rope *own)
{
    return kmp_yaml_get(own->map, "axial_stiffness") || kmp_yaml_get(own->map, "stiffness");
}

static bool is_taut(const rope *own)
{
    return !is_elastic(own) && kmp_is_word(kmp_yaml_get(own->map, "slack"), "no");
}

/* Between two drums, as kmp_rope_is_belt. */
static bool is_belt(const rope *own)
{
    const kmp_yaml *const *places = own->along->items;
    return kmp_yaml_get(places[0], "drum") && kmp_yaml_get(places[own->along->count - 1], "drum");
}

/* The closure or the contact. */
static void add_tension(const rope *own)
{
    kmp_reader *r = own->entries.r;
    kmp_arena *arena = &r->scratch;
    const char *axial = text_of(own, "axial_stiffness"), *stiffness = text_of(own, "stiffness");
    const char *damping = text_of(own, "damping"), *law = text_of(own, "force"), *name = own->entries.key->text;
    const kmp_place place = own->map->place;
    const kmp_yaml *restitution = kmp_yaml_get(own->map, "restitution");
    const kmp_yaml *gap = word(r, place, kmp_reader_say(r, "free_length(%s) - length(%s)", own->own, own->own));
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, place);
    if (law && strcmp(law, "0") == 0) /* only a path */
        return;
    if (law) {
        kmp_yaml_put_word(arena, entry, place, "sliding", kmp_reader_say(r, "length(%s)", own->own));
        kmp_yaml_put(arena, entry, place, "force",
                     word(r, kmp_yaml_get(own->map, "force")->place, kmp_reader_say(r, "-(%s)", law)));
        add_entry(own, "forces", name, entry);
        return;
    }
    kmp_yaml_put(arena, entry, place, is_taut(own) ? "constraint" : "gap", gap);
    if (stiffness && !damping) { /* its energy is potential */
        kmp_yaml_put_word(arena, entry, place, "law", "hertz");
        kmp_yaml_put_word(arena, entry, place, "exponent", "1");
        kmp_yaml_put(arena, entry, place, "stiffness", kmp_yaml_get(own->map, "stiffness"));
    } else if (stiffness || axial) {
        const char *strain = damping ? kmp_reader_say(r, "(depth + (%s)*rate)", damping) : "depth";
        const char *over = is_belt(own) ? "length" : "free_length";
        const char *force = stiffness ? kmp_reader_say(r, "(%s)*%s", stiffness, strain)
                                      : kmp_reader_say(r, "(%s)*%s/%s(%s)", axial, strain, over, own->own);
        kmp_yaml_put_word(arena, entry, place, "force", force);
    } else if (!is_taut(own)) {
        kmp_yaml_put(arena, entry, place, "restitution", restitution ? restitution : word(r, place, "0"));
    }
    add_entry(own, is_taut(own) ? "loops" : "contacts", name, entry);
}

static bool rubs(const kmp_yaml *place)
{
    return kmp_yaml_get(place, "round") && kmp_yaml_get(place, "friction");
}

/* The name of the friction at a place, after the rope's name: with the number of the place where the rope has several.
 */
static const char *friction_name(const rope *own, const char *name, int k)
{
    int count = 0;
    for (int i = 0; i < own->along->count; i++)
        count += rubs(own->along->items[i]);
    return count > 1 ? kmp_reader_say(own->entries.r, "%s_friction_%d", name, k + 1)
                     : kmp_reader_say(own->entries.r, "%s_friction", name);
}

/* The tension behind a sheave: the tension of the last part, less the friction of all sheaves behind it. */
static const char *tension_behind(const rope *own, int k)
{
    const char *sum = kmp_reader_say(own->entries.r, "tension(%s)", own->own);
    for (int i = own->along->count - 1; i > k; i--)
        if (rubs(own->along->items[i]))
            sum = kmp_reader_say(own->entries.r, "%s - lambda(%s)", sum, friction_name(own, own->own, i));
    return sum;
}

/* Friction on the sheave at a place, from 0. */
static void add_friction(const rope *own, int k)
{
    kmp_reader *r = own->entries.r;
    const kmp_yaml *sheave = own->along->items[k];
    const rope at = {.map = sheave};
    const char *mu = text_of(&at, "friction"), *groove = text_of(&at, "groove");
    const char *factor = groove ? kmp_reader_say(r, "(%s)/sin((%s)/2)", mu, groove) : kmp_reader_say(r, "(%s)", mu);
    const char *power = kmp_reader_say(r, "%s*wrap(%s.%d)", factor, own->own, k + 1), *behind = tension_behind(own, k);
    const char *const levels[2] = {kmp_reader_say(r, "(exp(%s) - 1)*(%s)", power, behind),
                                   kmp_reader_say(r, "(1 - exp(-%s))*(%s)", power, behind)};
    const char *slide = kmp_reader_say(r, "slide(%s.%d)", own->own, k + 1);
    add_entry(own, "forces", friction_name(own, own->entries.key->text, k),
              kmp_yaml_friction(&r->scratch, sheave->place, slide, levels));
}

/* A rigid contact has no multiplier that a level could have: it is among the forces of its modes. */
static void add_frictions(const rope *own)
{
    for (int k = own->along->count - 1; k >= 0; k--) {
        const kmp_yaml *sheave = own->along->items[k];
        if (!rubs(sheave))
            continue;
        if (!is_elastic(own) && !is_taut(own)) {
            kmp_reader_complain(own->entries.r, sheave->place,
                                "rope '%s': friction on a sheave is for an elastic rope, or for an inextensible one "
                                "with 'slack: no'; no level of friction has the force of a rigid contact",
                                own->entries.key->text);
            return;
        }
        add_friction(own, k);
    }
}

/* -- wheels with grip ---------------------------------------------------------------------------------- */

static const kmp_yaml *path_of(const kmp_yaml *map)
{
    const kmp_yaml *along = kmp_yaml_get(map, "along"), *list = along ? along : kmp_yaml_get(map, "around");
    return list && list->kind == KMP_YAML_LIST && list->count > 0 ? list : NULL;
}

static bool grips(const kmp_yaml *place)
{
    return kmp_yaml_get(place, "round") && kmp_is_word(kmp_yaml_get(place, "grip"), "yes");
}

/* A wheel with grip as the end of a part: a drum. */
static const kmp_yaml *as_drum(kmp_reader *r, const kmp_yaml *place)
{
    kmp_yaml *drum = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, place->place);
    for (int k = 0; k < place->count; k++) {
        const char *key = place->keys[k]->text;
        if (strcmp(key, "grip") != 0)
            kmp_yaml_put(&r->scratch, drum, place->keys[k]->place, strcmp(key, "round") == 0 ? "drum" : key,
                         place->items[k]);
    }
    return drum;
}

/* The part of a rope from one place to another one, which follows it in the list or from its beginning on. */
static const kmp_yaml *part_of(kmp_reader *r, const kmp_yaml *map, int from, int to)
{
    kmp_arena *arena = &r->scratch;
    const kmp_yaml *path = path_of(map);
    kmp_yaml *part = kmp_yaml_new(arena, KMP_YAML_MAP, map->place);
    kmp_yaml *places = kmp_yaml_new(arena, KMP_YAML_LIST, path->place);
    for (int k = from;; k = (k + 1) % path->count) {
        const kmp_yaml *place = path->items[k];
        kmp_yaml_append(arena, places, NULL, grips(place) ? as_drum(r, place) : place);
        if (k == to && places->count > 1)
            break;
    }
    kmp_yaml_put(arena, part, path->place, "along", places);
    for (int k = 0; k < map->count; k++)
        if (map->items[k] != path)
            kmp_yaml_put(arena, part, map->keys[k]->place, map->keys[k]->text, map->items[k]);
    return part;
}

/* Puts the parts of a rope between wheels with grip into a section, NAME_1, NAME_2, .., or the rope without them. */
static void divide(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *map, kmp_yaml *parts)
{
    const kmp_yaml *path = path_of(map);
    const bool closed = kmp_yaml_get(map, "around") && !kmp_yaml_get(map, "along");
    int first = -1, from = closed ? -1 : 0, count = 0;
    for (int k = 0; path && k < path->count; k++) {
        const bool grip = grips(path->items[k]), end = !closed && k == path->count - 1;
        if (grip && !closed && (k == 0 || end))
            kmp_reader_complain(r, path->items[k]->place, "rope '%s': a rope ends on a drum, not on a wheel with grip",
                                key->text);
        if (!grip && !(end && first >= 0))
            continue;
        if (from >= 0)
            kmp_yaml_put(&r->scratch, parts, key->place, kmp_reader_say(r, "%s_%d", key->text, ++count),
                         part_of(r, map, from, k));
        first = first < 0 ? k : first;
        from = k;
    }
    if (first >= 0 && closed)
        kmp_yaml_put(&r->scratch, parts, key->place, kmp_reader_say(r, "%s_%d", key->text, ++count),
                     part_of(r, map, from, first));
    const kmp_yaml *slack = kmp_yaml_get(map, "slack");
    if (first < 0)
        kmp_yaml_put(&r->scratch, parts, key->place, key->text, map);
    else if (closed && kmp_is_word(slack, "no"))
        kmp_reader_complain(r, slack->place,
                            "rope '%s': the tensions of a closed belt without slack are not unique: leave out slack, "
                            "or give axial_stiffness and preload",
                            key->text);
    else if (kmp_yaml_get(map, "length") || kmp_yaml_get(map, "stiffness") || kmp_yaml_get(map, "force"))
        kmp_reader_complain(r, key->place,
                            "rope '%s': a rope that wheels with grip divide has the length at the start, and its "
                            "stiffness is axial_stiffness: leave out length, stiffness and force",
                            key->text);
}

/* -- all of them --------------------------------------------------------------------------------------- */

void kmp_read_rope_elements(kmp_reader *r)
{
    const kmp_yaml *ropes = kmp_yaml_get(r->root, "ropes");
    if (!ropes || ropes->kind != KMP_YAML_MAP || ropes->count == 0)
        return;
    kmp_yaml *root = kmp_yaml_copy(&r->scratch, r->root);
    kmp_yaml *parts = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, ropes->place);
    if (!root || !parts)
        return;
    for (int k = 0; k < ropes->count; k++)
        if (ropes->items[k])
            divide(r, ropes->keys[k], ropes->items[k], parts);
    root->items[kmp_yaml_find(root, "ropes")] = parts;
    for (int k = 0; k < parts->count; k++) {
        const kmp_yaml *map = parts->items[k], *key = parts->keys[k];
        const rope own = {.entries = {r, "rope", key, root},
                          .map = map,
                          .along = path_of(map),
                          .own = kmp_reader_own_name(r, key->place.file, key->text)};
        if (!own.along) /* reported where the path is read */
            continue;
        add_tension(&own);
        add_frictions(&own);
    }
    r->root = root;
}
