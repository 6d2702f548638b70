/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints with clearance, rewritten before the model is read: the joint becomes one that moves freely in a plane, and
 * its keys `clearance` and `contact` an entry of `contacts` of its name. A revolute joint keeps the name of its
 * coordinate; those of the journal's centre are JOINT_x and JOINT_y. */
#include "model/compliant/compliant.h"
#include "model/files/nodes.h"
#include "model/read/reading.h"
#include <string.h>

typedef struct rewriting {
    kmp_reader *r;
    kmp_yaml *root, *contacts; /* copies that may change */
} rewriting;

static kmp_arena *arena_of(const rewriting *w)
{
    return &w->r->scratch;
}

/* Replaces an item of a mapping; the key must exist. */
static void replace(kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    for (int k = 0; map && k < map->count; k++)
        if (strcmp(map->keys[k]->text, key) == 0)
            map->items[k] = item;
}

static bool has_clearance(const kmp_yaml *map)
{
    return map && (kmp_yaml_get(map, "clearance") || kmp_yaml_get(map, "contact"));
}

/* A joint's name in its own file, whose prefix the name of the model has. */
static const char *bare(const rewriting *w, const char *name, int file)
{
    const kmp_include_instance *instance = kmp_reader_instance(w->r, file);
    return name + (instance ? strlen(instance->prefix) : 0);
}

/* The names of the three coordinates. */
static const kmp_yaml *coordinates(const rewriting *w, const char *name, const kmp_yaml *at)
{
    kmp_yaml *list = kmp_yaml_new(arena_of(w), KMP_YAML_LIST, at->place);
    const char *names[3] = {kmp_reader_say(w->r, "%s_x", name), kmp_reader_say(w->r, "%s_y", name), name};
    for (int k = 0; k < 3; k++)
        kmp_yaml_append(arena_of(w), list, NULL, kmp_yaml_word(arena_of(w), at->place, names[k]));
    return list;
}

/* The joint or closure without clearance that leaves the plane free. */
static const kmp_yaml *free_in_plane(const rewriting *w, const char *name, const kmp_yaml *map, bool coordinate)
{
    kmp_yaml *made = kmp_yaml_new(arena_of(w), KMP_YAML_MAP, map->place);
    for (int k = 0; k < map->count; k++) {
        const char *key = map->keys[k]->text;
        bool kind = strcmp(key, "revolute") == 0, gone = strcmp(key, "clearance") == 0 || strcmp(key, "contact") == 0;
        if (!gone)
            kmp_yaml_put(arena_of(w), made, map->keys[k]->place, kind ? "planar" : key, map->items[k]);
    }
    if (coordinate && !kmp_yaml_get(map, "coordinates"))
        kmp_yaml_put(arena_of(w), made, map->place, "coordinates", coordinates(w, bare(w, name, map->place.file), map));
    return made;
}

/* The entry of the section contacts. */
static void add_contact(rewriting *w, const kmp_yaml *key, const char *name, const kmp_yaml *map, const char *what)
{
    const kmp_yaml *clearance = kmp_read_required(w->r, map, what, "clearance");
    const kmp_yaml *contact = kmp_read_required(w->r, map, what, "contact");
    if (!clearance || !contact || !kmp_read_map(w->r, contact, kmp_reader_say(w->r, "contact of %s", what), NULL))
        return;
    if (kmp_yaml_get(w->contacts, name)) {
        kmp_reader_complain(w->r, key->place, "%s: the section contacts has '%s', the name of its own contact, already",
                            what, name);
        return;
    }
    kmp_yaml *own = kmp_yaml_new(arena_of(w), KMP_YAML_MAP, contact->place);
    const kmp_yaml *joint = kmp_yaml_word(arena_of(w), key->place, bare(w, name, key->place.file));
    kmp_yaml_put(arena_of(w), own, contact->place, "journal", joint);
    kmp_yaml_put(arena_of(w), own, clearance->place, "clearance", clearance);
    for (int k = 0; k < contact->count; k++)
        kmp_yaml_put(arena_of(w), own, contact->keys[k]->place, contact->keys[k]->text, contact->items[k]);
    kmp_yaml_put(arena_of(w), w->contacts, key->place, name, own);
}

/* The joint in place of one with clearance; the same where it has none, or cannot have one. */
static const kmp_yaml *rewrite(rewriting *w, const kmp_yaml *key, const char *name, const kmp_yaml *map,
                               const char *what, bool coordinate)
{
    if (!has_clearance(map))
        return map;
    if (!kmp_yaml_get(map, "revolute")) {
        const kmp_yaml *node = kmp_yaml_get(map, "clearance");
        kmp_reader_complain(w->r, (node ? node : kmp_yaml_get(map, "contact"))->place,
                            "%s: a revolute joint may have a clearance, and this is none", what);
        return map;
    }
    add_contact(w, key, name, map, what);
    return free_in_plane(w, name, map, coordinate);
}

static kmp_yaml *open_section(rewriting *w, const char *key)
{
    const kmp_yaml *section = kmp_yaml_get(w->root, key);
    kmp_yaml *copy = section && section->kind == KMP_YAML_MAP ? kmp_yaml_copy(arena_of(w), section) : NULL;
    if (copy)
        replace(w->root, key, copy);
    return copy;
}

static void rewrite_bodies(rewriting *w)
{
    kmp_yaml *bodies = open_section(w, "bodies");
    for (int k = 0; bodies && k < bodies->count; k++) {
        const kmp_yaml *joint = kmp_yaml_get(bodies->items[k], "joint"), *named = kmp_yaml_get(joint, "name");
        const char *name = named ? kmp_reader_name(w->r, named->place.file, named->text) : bodies->keys[k]->text;
        if (!has_clearance(joint))
            continue;
        kmp_yaml *body = kmp_yaml_copy(arena_of(w), bodies->items[k]);
        const char *what = kmp_reader_say(w->r, "the joint of body '%s'", bodies->keys[k]->text);
        if (!body)
            return;
        replace(body, "joint", rewrite(w, named ? named : bodies->keys[k], name, joint, what, true));
        bodies->items[k] = body;
    }
}

/* Joints between bodies, or loops, which have no coordinates. */
static void rewrite_section(rewriting *w, const char *section, const char *kind)
{
    kmp_yaml *map = open_section(w, section);
    for (int k = 0; map && k < map->count; k++) {
        const char *name = map->keys[k]->text;
        map->items[k] = rewrite(w, map->keys[k], name, map->items[k], kmp_reader_say(w->r, "%s '%s'", kind, name),
                                strcmp(section, "joints") == 0);
    }
}

static bool any_clearance(const kmp_yaml *root)
{
    static const char *const sections[] = {"bodies", "joints", "loops"};
    bool any = false;
    for (int s = 0; s < 3; s++) {
        const kmp_yaml *map = kmp_yaml_get(root, sections[s]);
        for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++)
            any = any || has_clearance(s ? map->items[k] : kmp_yaml_get(map->items[k], "joint"));
    }
    return any;
}

void kmp_read_clearances(kmp_reader *r)
{
    rewriting w = {.r = r};
    const kmp_yaml *contacts = kmp_yaml_get(r->root, "contacts");
    if (!any_clearance(r->root))
        return;
    w.root = kmp_yaml_copy(arena_of(&w), r->root);
    w.contacts = contacts && contacts->kind == KMP_YAML_MAP ? kmp_yaml_copy(arena_of(&w), contacts)
                                                            : kmp_yaml_new(arena_of(&w), KMP_YAML_MAP, r->root->place);
    if (!w.root || !w.contacts)
        return;
    rewrite_bodies(&w);
    rewrite_section(&w, "joints", "joint");
    rewrite_section(&w, "loops", "loop");
    if (contacts)
        replace(w.root, "contacts", w.contacts);
    else
        kmp_yaml_put(arena_of(&w), w.root, r->root->place, "contacts", w.contacts);
    r->root = w.root;
}
