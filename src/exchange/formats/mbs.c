/* SPDX-License-Identifier: BSD-3-Clause */
/* A ROBOTRAN model, converted to an equivalent YAML document; its nodes have the places of the elements that they come
 * from. Values common to both languages are passed on unread: the reader checks them. Names lose the characters that
 * Kempe's names do not have. Laws of forces are functions in user code in ROBOTRAN, so they are not converted. */
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "exchange/formats/foreign_parts.h"
#include "exchange/formats/formats.h"
#include "exchange/formats/importing.h"
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const kmp_element *first_body(const kmp_import *im)
{
    return kmp_element_find(kmp_element_find(im->model, "bodytree"), "body");
}

static const kmp_element *first_cut(const kmp_import *im)
{
    const kmp_element *cuts = kmp_element_find(im->model, "cuts");
    return cuts ? cuts->first : NULL;
}

/* The text of an element, unchanged; no text is an empty scalar, which the reader rejects. */
static const kmp_yaml *text_of(kmp_import *im, const kmp_element *e)
{
    return kmp_yaml_word(im->arena, e->text_place, e->text);
}

/* A number that may be absent: 0. */
static void put_number(kmp_import *im, kmp_yaml *map, const char *key, const kmp_element *in, const char *name)
{
    const kmp_element *e = kmp_element_find(in, name);
    if (e)
        kmp_import_put(im, map, e->place, key, text_of(im, e));
}

static const kmp_yaml *vector(kmp_import *im, const kmp_element *in)
{
    static const char *const names[3] = {"x", "y", "z"};
    const kmp_element *coordinates = kmp_element_find(in, "coordinates");
    kmp_yaml *list = kmp_yaml_new(im->arena, KMP_YAML_LIST, in->place);
    for (int k = 0; k < 3; k++) {
        const kmp_element *e = kmp_element_find(coordinates, names[k]);
        kmp_yaml_append(im->arena, list, NULL, e ? text_of(im, e) : kmp_yaml_word(im->arena, in->place, "0"));
    }
    return list;
}

/* -- names ----------------------------------------------------------------------------------------- */

/* The name inside an element; NULL after an error or without memory. */
static const char *name_of(kmp_import *im, const kmp_element *e, const char *key)
{
    const char *name = kmp_element_text(e, key);
    if (!name)
        kmp_import_complain(im, e->place, "element", e->name, "has no name");
    return name ? kmp_import_clean(im, name) : NULL;
}

/* A name of a body, of a joint on it, or of a cut: without a body. */
typedef struct kmp_mbs_name {
    const char *text;
    const kmp_element *body, *joint;
    int number; /* in the order of the file, from 1; 0: of a cut */
} kmp_mbs_name;

/* Compares names without the characters that Kempe's names do not have. */
static int compare_texts(const char *a, const char *b)
{
    for (;; a++, b++) {
        char x = !*a || kmp_import_is_letter(*a) ? *a : '_', y = !*b || kmp_import_is_letter(*b) ? *b : '_';
        if (x != y || !x)
            return x < y ? -1 : x > y;
    }
}

static int compare_names(const void *a, const void *b)
{
    const kmp_mbs_name *x = a, *y = b;
    int order = compare_texts(x->text, y->text);
    return order != 0 ? order : x->number < y->number ? -1 : x->number > y->number;
}

static void add_name(kmp_import *im, const char *text, const kmp_element *body, const kmp_element *joint)
{
    kmp_mbs_name *list = text ? kmp_arena_room(im->arena, im->names, im->name_count, sizeof *list) : NULL;
    if (!list)
        return;
    im->names = list;
    list[im->name_count] = (kmp_mbs_name){text, body, joint, body ? im->name_count + 1 : 0};
    im->name_count++;
}

/* Names that are one name in Kempe, one after the other: cuts, then the others in the order of the file. */
static const kmp_mbs_name *first_like(const kmp_import *im, const char *text)
{
    int low = 0, high = im->name_count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (compare_texts(im->names[middle].text, text) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low < im->name_count && compare_texts(im->names[low].text, text) == 0 ? im->names + low : NULL;
}

static const kmp_mbs_name *next_like(const kmp_import *im, const kmp_mbs_name *n)
{
    bool more = n + 1 < im->names + im->name_count && compare_texts(n->text, n[1].text) == 0;
    return more ? n + 1 : NULL;
}

/* -- points ---------------------------------------------------------------------------------------- */

static bool is_ground(const char *body)
{
    return strcmp(body, "base") == 0;
}

static const kmp_element *find_body(const kmp_import *im, const char *name)
{
    if (is_ground(name))
        return kmp_element_find(im->model, "base");
    for (const kmp_mbs_name *n = first_like(im, name); n; n = next_like(im, n))
        if (n->body && !n->joint && strcmp(n->text, name) == 0)
            return n->body;
    return NULL;
}

/* Writes the points of a body. `origin` exists without declaration; elements between points name it. */
static void put_points(kmp_import *im, kmp_yaml *map, const kmp_element *body)
{
    kmp_yaml *points = kmp_import_part(im, map, "points", KMP_YAML_MAP);
    for (const kmp_element *p = kmp_element_find(body, "point"); p; p = kmp_element_again(p)) {
        const char *name = name_of(im, p, "pointname");
        if (name && kmp_yaml_get(points, name))
            kmp_import_complain(im, p->place, "point", name, "exists twice in its body: names must be unique");
        else if (name)
            kmp_import_put(im, points, p->place, name, vector(im, p));
    }
    if (!kmp_yaml_get(points, "origin")) {
        static const double zero[3] = {0};
        kmp_import_vector(im, points, body->place, "origin", zero);
    }
}

/* BODY.POINT from an element's `bodyname` and `pointname`; an origin that is not named is the body. */
static const kmp_yaml *place_on(kmp_import *im, const kmp_element *e, bool point)
{
    const char *body = kmp_element_text(e, "bodyname"), *name = kmp_element_text(e, "pointname");
    if (!body) {
        kmp_import_complain(im, e->place, "element", e->name, "has no 'bodyname'");
        return NULL;
    }
    const char *on = is_ground(body) ? "ground" : kmp_import_clean(im, body);
    bool origin =
        !name || (strcmp(name, "origin") == 0 && !kmp_element_named(find_body(im, body), "point", "pointname", name));
    if (!on || (origin && !point))
        return on ? kmp_yaml_word(im->arena, e->place, on) : NULL;
    const char *at = kmp_import_clean(im, name ? name : "origin");
    const char *full = at ? kmp_arena_printf(im->arena, "%s.%s", on, at) : NULL;
    return full ? kmp_yaml_word(im->arena, e->place, full) : NULL;
}

/* -- joints ---------------------------------------------------------------------------------------- */

/* The name of a joint of ROBOTRAN where nothing else that names a joint has it; otherwise NULL. `single`: no other is
 * on its body, whose name it may have. */
static const char *own_name(const kmp_import *im, const kmp_element *body, const kmp_element *joint, bool single)
{
    const char *name = kmp_element_text(joint, "jointname");
    for (const kmp_mbs_name *n = name ? first_like(im, name) : NULL; n; n = next_like(im, n))
        if (n->joint ? n->joint != joint : n->body && !(n->body == body && single))
            return NULL;
    return name;
}

/* The constraint of a driven joint: its start value, or the motion that begins with its start values. */
static const kmp_yaml *drive(kmp_import *im, const kmp_element *joint, const char *coordinate, const char *type)
{
    const kmp_element *start = kmp_element_find(joint, "initialvalue");
    const char *q = kmp_element_text(start, "q"), *qd = kmp_element_text(start, "qd");
    kmp_yaml *map = kmp_import_map(im, joint->place);
    kmp_import_word(im, map, joint->place, "joint", coordinate);
    if (!qd || strtod(qd, NULL) == 0) {
        kmp_import_word(im, map, joint->place, "locked", "yes");
        return map;
    }
    const char *law = kmp_arena_printf(im->arena, "(%s) + (%s)*t", q ? q : "0", qd);
    if (law)
        kmp_import_put(im, map, joint->place, type && type[0] == 'T' ? "displacement" : "angle",
                       kmp_yaml_word(im->arena, start->place, law));
    return map;
}

/* Start value and `nature`: independent coordinates keep their values while the loops are closed, driven ones always.
 */
static void put_start(kmp_import *im, const kmp_element *joint, const char *coordinate, const char *drive_name)
{
    const kmp_element *start = kmp_element_find(joint, "initialvalue");
    const char *nature = kmp_element_text(joint, "nature");
    kmp_yaml *begin = kmp_import_part(im, im->root, "start", KMP_YAML_MAP);
    if (kmp_element_text(start, "q"))
        put_number(im, kmp_import_part(im, begin, "q", KMP_YAML_MAP), coordinate, start, "q");
    if (kmp_element_text(start, "qd"))
        put_number(im, kmp_import_part(im, begin, "qd", KMP_YAML_MAP), coordinate, start, "qd");
    if (nature && strcmp(nature, "driven") == 0)
        kmp_import_add(im, "drives", joint, drive_name, drive(im, joint, coordinate, kmp_element_text(joint, "type")));
    else if (nature && strcmp(nature, "independent") == 0)
        kmp_import_hold(im, joint->place, coordinate);
    else if (nature && strcmp(nature, "dependent") != 0)
        kmp_import_complain(im, joint->place, "nature", nature, "is not independent, dependent or driven");
}

/* The joints of a body in their order: motions, coordinates with the names of the joints, start and drives. */
static void put_motions(kmp_import *im, kmp_yaml *map, const kmp_element *body, const char *name)
{
    const kmp_element *joint = kmp_element_find(body, "joint");
    kmp_yaml *motions = kmp_yaml_new(im->arena, KMP_YAML_LIST, joint->place);
    kmp_yaml *names = kmp_yaml_new(im->arena, KMP_YAML_LIST, joint->place);
    bool several = kmp_element_again(joint);
    for (int k = 1; joint; k++, joint = kmp_element_again(joint)) {
        const kmp_element *type = kmp_element_find(joint, "type");
        const char *own = several ? own_name(im, body, joint, false) : NULL;
        if (type)
            kmp_yaml_append(im->arena, motions, NULL, text_of(im, type));
        else
            kmp_import_complain(im, joint->place, "a joint of body", name, "has no 'type'");
        own = own ? kmp_import_clean(im, own) : NULL;
        kmp_yaml_append(im->arena, names, NULL, kmp_yaml_word(im->arena, joint->place, own ? own : "~"));
        /* Its coordinate and its drive. */
        const bool numbered = several && !own;
        const char *coordinate = own ? own : name;
        const char *drive_name = numbered ? kmp_arena_printf(im->arena, "%s_%d", coordinate, k) : coordinate;
        const char *full = numbered ? kmp_arena_printf(im->arena, "%s.%d", coordinate, k) : coordinate;
        const kmp_mbs_name *first = drive_name ? first_like(im, drive_name) : NULL;
        if (first && !first->body) /* of a cut */
            drive_name = kmp_arena_printf(im->arena, "%s_drive", drive_name);
        if (full && drive_name)
            put_start(im, joint, full, drive_name);
    }
    kmp_import_put(im, map, map->place, "motions", motions);
    if (several)
        kmp_import_put(im, map, map->place, "coordinates", names);
}

/* -- bodies ---------------------------------------------------------------------------------------- */

static void put_joint(kmp_import *im, kmp_yaml *map, const kmp_element *body, const char *body_name)
{
    const kmp_element *parent = kmp_element_find(body, "parent");
    const kmp_element *joint = kmp_element_find(body, "joint");
    /* ROBOTRAN's name where there is one, otherwise the body's. */
    const char *given = joint && !kmp_element_again(joint) ? own_name(im, body, joint, true) : NULL;
    const char *name = given ? kmp_import_clean(im, given) : body_name;
    kmp_yaml *own = kmp_import_map(im, joint ? joint->place : body->place);
    if (!parent) {
        kmp_import_complain(im, body->place, "body", body_name, "has no 'parent'");
        return;
    }
    if (!name || !own)
        return;
    kmp_import_word(im, own, own->place, "name", name);
    kmp_import_put(im, own, own->place, "at", place_on(im, parent, false));
    if (joint)
        put_motions(im, own, body, name);
    else
        kmp_import_word(im, own, own->place, "weld", "yes");
    kmp_import_put(im, map, own->place, "joint", own);
}

/* Inertias are accepted as given: published models contain some that no distribution of mass can have. */
static void put_inertia(kmp_import *im, kmp_yaml *map, const kmp_element *body)
{
    static const char *const names[6][2] = {{"Ixx", "xx"}, {"Iyy", "yy"}, {"Izz", "zz"},
                                            {"Ixy", "xy"}, {"Ixz", "xz"}, {"Iyz", "yz"}};
    const kmp_element *inertia = kmp_element_find(body, "inertia");
    if (!inertia)
        return;
    kmp_yaml *own = kmp_import_map(im, inertia->place);
    for (int k = 0; k < 6; k++)
        put_number(im, own, names[k][1], inertia, names[k][0]);
    kmp_import_word(im, own, inertia->place, "as_given", "yes");
    kmp_import_put(im, map, inertia->place, "inertia", own);
}

static void add_body(kmp_import *im, const kmp_element *body)
{
    const char *name = name_of(im, body, "bodyname");
    const kmp_element *com = kmp_element_find(body, "com");
    kmp_yaml *map = kmp_import_map(im, body->place);
    if (!name || !map)
        return;
    put_joint(im, map, body, name);
    put_number(im, map, "mass", body, "mass");
    if (com)
        kmp_import_put(im, map, com->place, "com", vector(im, com));
    put_inertia(im, map, body);
    put_points(im, map, body);
    kmp_import_add(im, "bodies", body, name, map);
}

/* -- cuts ------------------------------------------------------------------------------------------ */

static void refuse_ignored(kmp_import *im, const kmp_element *cut, const char *name)
{
    const kmp_element *ignore = kmp_element_find(cut, "ignore");
    for (const kmp_element *row = ignore ? ignore->first : NULL; row; row = row->next)
        if (strcmp(row->text, "false") != 0 && strcmp(row->text, "0") != 0) {
            kmp_import_complain(im, ignore->place, "cut", name,
                                "ignores some of its equations, which Kempe does not support: delete 'ignore'; "
                                "redundant equations are detected automatically");
            return;
        }
}

/* The second end point comes first: in ROBOTRAN h is the vector to the first one. */
static void add_cut(kmp_import *im, const kmp_element *cut, const char *kind)
{
    static const char *const ends[2] = {"endpoint2", "endpoint1"};
    const char *name = name_of(im, cut, "name");
    kmp_yaml *map = kmp_import_map(im, cut->place), *points = kmp_yaml_new(im->arena, KMP_YAML_LIST, cut->place);
    if (!name)
        return;
    for (int k = 0; k < 2; k++) {
        const kmp_element *end = kmp_element_find(cut, ends[k]);
        if (end)
            kmp_yaml_append(im->arena, points, NULL, place_on(im, end, true));
        else
            kmp_import_complain(im, cut->place, "cut", name, k == 0 ? "has no 'endpoint2'" : "has no 'endpoint1'");
    }
    kmp_import_put(im, map, cut->place, kind, points);
    put_number(im, map, "length", cut, "length");
    refuse_ignored(im, cut, name);
    kmp_import_add(im, "loops", cut, name, map);
}

/* -- data of user code ----------------------------------------------------------------------------- */

static bool is_number(const char *text)
{
    double value;
    size_t sign = text[0] == '-';
    size_t length = kmp_text_to_number(text + sign, &value);
    return length > 0 && !text[sign + length];
}

/* A scalar of a user model becomes the parameter MODEL_NAME, for the forces that a user adds; the first one of a name
 * counts. */
static void add_parameters(kmp_import *im)
{
    const kmp_element *m = kmp_element_find(kmp_element_find(im->model, "user_models"), "user_model");
    for (; m; m = kmp_element_again(m)) {
        const char *model = kmp_element_text(m, "name");
        for (const kmp_element *p = kmp_element_find(m, "parameter"); model && p; p = kmp_element_again(p)) {
            const char *type = kmp_element_text(p, "type"), *name = kmp_element_text(p, "name");
            const kmp_element *value = kmp_element_find(p, "value");
            if (!name || !type || strcmp(type, "scalar") != 0 || !value || !is_number(value->text))
                continue;
            kmp_yaml *parameters = kmp_import_part(im, im->root, "parameters", KMP_YAML_MAP);
            const char *full = kmp_arena_printf(im->arena, "%s_%s", model, name);
            full = full ? kmp_import_clean(im, full) : NULL;
            if (full && !kmp_yaml_get(parameters, full))
                kmp_import_put(im, parameters, p->place, full, text_of(im, value));
        }
    }
}

/* -- notes ----------------------------------------------------------------------------------------- */

static void omit(kmp_import *im, const char *what, const kmp_element *e)
{
    const char *name = kmp_element_text(e, "name");
    kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, e->name,
                         "%s '%s' is not used: its law is in user code; write a force of Kempe", what,
                         name ? name : "");
}

static void omit_force_points(kmp_import *im, const kmp_element *inside)
{
    for (const kmp_element *e = inside->first; e; e = e->next) {
        if (strcmp(e->name, "extforce") == 0)
            omit(im, "force point", e);
        else if (strcmp(e->name, "point") == 0 || strcmp(e->name, "joint") == 0)
            omit_force_points(im, e);
    }
}

/* All names that bodies, joints and cuts have, sorted. */
static void collect_names(kmp_import *im)
{
    for (const kmp_element *body = first_body(im); body; body = kmp_element_again(body)) {
        add_name(im, kmp_element_text(body, "bodyname"), body, NULL);
        for (const kmp_element *j = kmp_element_find(body, "joint"); j; j = kmp_element_again(j))
            add_name(im, kmp_element_text(j, "jointname"), body, j);
    }
    for (const kmp_element *cut = first_cut(im); cut; cut = cut->next)
        add_name(im, kmp_element_text(cut, "name"), NULL, NULL);
    if (im->name_count > 0)
        qsort(im->names, (size_t)im->name_count, sizeof *im->names, compare_names);
}

static void add_cuts(kmp_import *im)
{
    static const char *const kinds[3][2] = {{"ball", "ball"}, {"rod", "rod"}, {"solid", "weld"}};
    for (const kmp_element *cut = first_cut(im); cut; cut = cut->next)
        for (int k = 0; k < 3; k++)
            if (strcmp(cut->name, kinds[k][0]) == 0)
                add_cut(im, cut, kinds[k][1]);
}

static void note_rest(kmp_import *im)
{
    const kmp_element *links = kmp_element_find(im->model, "links");
    for (const kmp_element *body = first_body(im); body; body = kmp_element_again(body))
        omit_force_points(im, body);
    for (const kmp_element *e = links ? links->first : NULL; e; e = e->next)
        if (strcmp(e->name, "link") == 0 || strcmp(e->name, "link3D") == 0)
            omit(im, "link", e);
}

void kmp_mbs_convert(kmp_import *im)
{
    const kmp_element *name = kmp_element_find(im->model, "mbsname"), *base = kmp_element_find(im->model, "base");
    const kmp_element *gravity = kmp_element_find(base, "gravity");
    if (name && name->text[0])
        kmp_import_put(im, im->root, name->place, "name", text_of(im, name));
    if (im->base == KMP_BASE_FREE)
        kmp_import_complain(im, im->model->place, "base", "free",
                            "is for robots: a ROBOTRAN model has the joints of its first body instead");
    collect_names(im);
    add_parameters(im);
    if (gravity)
        kmp_import_put(im, im->root, gravity->place, "gravity", vector(im, gravity));
    put_points(im, kmp_import_part(im, im->root, "ground", KMP_YAML_MAP), base ? base : im->model);
    for (const kmp_element *body = first_body(im); body; body = kmp_element_again(body))
        add_body(im, body);
    add_cuts(im);
    note_rest(im);
}
