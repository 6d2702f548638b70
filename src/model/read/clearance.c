/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints with clearance, rewritten before the model is read: the joint becomes one that moves freely in a plane, and
 * its keys `clearance` and `contact` entries of `contacts`. A revolute joint keeps the name of its coordinate; the
 * coordinates of the journal's centre are JOINT_x and JOINT_y. A prismatic one keeps its name, too; the others are
 * JOINT_across and JOINT_angle, and each corner of the slider is a contact. A ball closure is left out: its contact is
 * all of it. */
#include "model/read/clearance.h"
#include "model/files/nodes.h"
#include "model/read/read_compliant.h"
#include "model/read/read_include.h"
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

static bool has_clearance(const kmp_yaml *map)
{
    return map && (kmp_yaml_get(map, "clearance") || kmp_yaml_get(map, "contact"));
}

static const kmp_yaml *word(const rewriting *w, kmp_place place, const char *text)
{
    return kmp_yaml_word(arena_of(w), place, text);
}

/* x, y, z as 0, 1, 2; -1: another direction. */
static int letter_of(const kmp_yaml *node)
{
    bool one = node && node->kind == KMP_YAML_SCALAR && strlen(node->text) == 1;
    return one && node->text[0] >= 'x' && node->text[0] <= 'z' ? node->text[0] - 'x' : -1;
}

static const char *const letters[] = {"x", "y", "z"};

/* A joint with clearance: what it is, and how it lies. */
typedef struct loose {
    const kmp_yaml *key, *map;
    const char *name, *what;
    bool slides, ball; /* neither: a revolute one */
    bool coordinate;   /* it has coordinates */
    int along, normal; /* of a slider: of its guide, of the plane of its motion */
} loose;

/* The names of the three coordinates: the two places, then the rotation. */
static const kmp_yaml *coordinates(const rewriting *w, const loose *l, const char *name)
{
    kmp_yaml *list = kmp_yaml_new(arena_of(w), KMP_YAML_LIST, l->map->place);
    const char *across = kmp_reader_say(w->r, "%s_across", name);
    const char *names[3] = {kmp_reader_say(w->r, "%s_x", name), kmp_reader_say(w->r, "%s_y", name), name};
    if (l->slides) {
        bool first = l->along == (l->normal + 1) % 3;
        names[0] = first ? name : across;
        names[1] = first ? across : name;
        names[2] = kmp_reader_say(w->r, "%s_angle", name);
    }
    for (int k = 0; k < 3; k++)
        kmp_yaml_append(arena_of(w), list, NULL, word(w, l->map->place, names[k]));
    return list;
}

/* The joint or closure without clearance that leaves the plane free. */
static const kmp_yaml *free_in_plane(const rewriting *w, const loose *l)
{
    const kmp_yaml *map = l->map;
    const char *kind = l->slides ? "prismatic" : "revolute";
    kmp_yaml *made = kmp_yaml_new(arena_of(w), KMP_YAML_MAP, map->place);
    for (int k = 0; k < map->count; k++) {
        const char *key = map->keys[k]->text;
        bool of_kind = strcmp(key, kind) == 0, gone = strcmp(key, "clearance") == 0 || strcmp(key, "contact") == 0;
        bool turned = l->slides && (strcmp(key, "axis") == 0 || (of_kind && map->items[k]->kind == KMP_YAML_SCALAR));
        const kmp_yaml *item = turned ? word(w, map->items[k]->place, letters[l->normal]) : map->items[k];
        if (!gone)
            kmp_yaml_put(arena_of(w), made, map->keys[k]->place, of_kind ? "planar" : key, item);
    }
    if (l->coordinate && !kmp_yaml_get(map, "coordinates"))
        kmp_yaml_put(arena_of(w), made, map->place, "coordinates",
                     coordinates(w, l, kmp_reader_own_name(w->r, map->place.file, l->name)));
    return made;
}

/* An entry of the section contacts, with `words`, pairs of a key and a word, before the keys of the joint. */
static void add_contact(rewriting *w, const loose *l, const char *name, const kmp_yaml *joint, const char *const *words)
{
    const kmp_yaml *clearance = kmp_yaml_get(l->map, "clearance"), *contact = kmp_yaml_get(l->map, "contact");
    if (kmp_yaml_get(w->contacts, name)) {
        kmp_complain_of(w->r, l->key, l->what, "the section contacts has '%s', the name of its own contact, already",
                        name);
        return;
    }
    kmp_yaml *own = kmp_yaml_new(arena_of(w), KMP_YAML_MAP, contact->place);
    kmp_yaml_put(arena_of(w), own, contact->place, l->slides ? "guide" : l->ball ? "socket" : "journal", joint);
    kmp_yaml_put(arena_of(w), own, clearance->place, "clearance", clearance);
    for (int k = 0; words[k]; k += 2)
        kmp_yaml_put_word(arena_of(w), own, contact->place, words[k], words[k + 1]);
    for (int k = 0; k < contact->count; k++)
        if (!l->slides || strcmp(contact->keys[k]->text, "axis") != 0)
            kmp_yaml_put(arena_of(w), own, contact->keys[k]->place, contact->keys[k]->text, contact->items[k]);
    kmp_yaml_put(arena_of(w), w->contacts, l->key->place, name, own);
}

/* A contact with a law has the name of its joint, a rigid one its own, because it has a multiplier. */
static void add_contacts(rewriting *w, const loose *l)
{
    const kmp_yaml *contact = kmp_yaml_get(l->map, "contact");
    const kmp_yaml *joint = word(w, l->key->place, kmp_reader_own_name(w->r, l->key->place.file, l->name));
    bool rigid = !kmp_yaml_get(contact, "law") && !kmp_yaml_get(contact, "force");
    if (!l->slides) {
        const char *name = rigid ? kmp_reader_say(w->r, "%s_journal", l->name) : l->name;
        add_contact(w, l, name, l->ball ? kmp_yaml_get(l->map, "ball") : joint, (const char *const[]){NULL});
        return;
    }
    for (int k = 0; kmp_guide_corner(k); k++)
        add_contact(w, l, kmp_reader_say(w->r, "%s_%s", l->name, kmp_guide_corner(k)), joint,
                    (const char *const[]){"corner", kmp_guide_corner(k), "axis", letters[l->along], NULL});
}

/* The direction of the guide and the plane of motion, whose normal is the `axis` of the contact. */
static bool find_directions(const rewriting *w, loose *l)
{
    const kmp_yaml *contact = kmp_yaml_get(l->map, "contact"), *normal = kmp_yaml_get(contact, "axis");
    const kmp_yaml *own = kmp_yaml_get(l->map, "prismatic"); /* a closure, and a joint between bodies, has `axis` */
    const kmp_yaml *along = own && own->kind == KMP_YAML_SCALAR ? own : kmp_yaml_get(l->map, "axis");
    const char *what = kmp_reader_say(w->r, "contact of %s", l->what);
    if (!kmp_read_required(w->r, contact, what, "length") || !kmp_read_required(w->r, contact, what, "height"))
        return false;
    l->along = letter_of(along);
    l->normal = normal ? letter_of(normal) : 2;
    if (l->along < 0)
        return kmp_complain_of(w->r, (along ? along : l->map), l->what,
                               "a prismatic joint with clearance is along x, y or z");
    return (l->normal >= 0 && l->normal != l->along) ||
           kmp_complain_of(w->r, (normal ? normal : l->map), l->what,
                           "the 'axis' of its contact is x, y or z, across the guide: the normal of the plane in which "
                           "the slider moves");
}

/* The joint in place of one with clearance; the same where it has none, or cannot have one; NULL: its contact is all of
 * it. */
static const kmp_yaml *rewrite(rewriting *w, loose l)
{
    const kmp_yaml *map = l.map, *node = kmp_yaml_get(map, "clearance");
    if (!has_clearance(map))
        return map;
    l.slides = kmp_yaml_get(map, "prismatic") != NULL;
    l.ball = kmp_yaml_get(map, "ball") != NULL;
    if (!l.slides && !l.ball && !kmp_yaml_get(map, "revolute")) {
        kmp_complain_of(w->r, (node ? node : kmp_yaml_get(map, "contact")), l.what,
                        "a revolute or a prismatic joint, or a ball closure, may have a clearance");
        return map;
    }
    const kmp_yaml *clearance = kmp_read_required(w->r, map, l.what, "clearance");
    const kmp_yaml *contact = kmp_read_required(w->r, map, l.what, "contact");
    if (!clearance || !contact || !kmp_read_map(w->r, contact, kmp_reader_say(w->r, "contact of %s", l.what), NULL) ||
        (l.slides && !find_directions(w, &l)))
        return map;
    add_contacts(w, &l);
    return l.ball ? NULL : free_in_plane(w, &l);
}

/* NULL: there is no such section. */
static kmp_yaml *open_section(rewriting *w, const char *key)
{
    const kmp_yaml *section = kmp_yaml_get(w->root, key);
    return section && section->kind == KMP_YAML_MAP ? kmp_yaml_open(arena_of(w), w->root, key) : NULL;
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
        const loose own = {named ? named : bodies->keys[k], joint, name, what, .coordinate = true};
        kmp_yaml_set(arena_of(w), body, "joint", rewrite(w, own));
        bodies->items[k] = body;
    }
}

/* Joints between bodies, or loops, which have no coordinates. */
static void rewrite_section(rewriting *w, const char *section, const char *kind)
{
    kmp_yaml *map = open_section(w, section);
    kmp_yaml *kept = map ? kmp_yaml_new(arena_of(w), KMP_YAML_MAP, map->place) : NULL;
    for (int k = 0; kept && k < map->count; k++) {
        const char *name = map->keys[k]->text, *what = kmp_reader_say(w->r, "%s '%s'", kind, name);
        const loose own = {map->keys[k], map->items[k], name, what, .coordinate = strcmp(section, "joints") == 0};
        kmp_yaml_put(arena_of(w), kept, map->keys[k]->place, name, rewrite(w, own));
    }
    kmp_yaml_set(arena_of(w), w->root, section, kept);
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
    if (!any_clearance(r->root))
        return;
    w.root = kmp_yaml_copy(arena_of(&w), r->root);
    w.contacts = w.root ? kmp_yaml_open(arena_of(&w), w.root, "contacts") : NULL;
    if (!w.contacts)
        return;
    rewrite_bodies(&w);
    rewrite_section(&w, "joints", "joint");
    rewrite_section(&w, "loops", "loop");
    r->root = w.root;
}
