/* SPDX-License-Identifier: BSD-3-Clause */
/* MuJoCo's format (docs/mjcf.md): other files that the model includes, classes of defaults, settings, and the order in
 * which its parts become a document. */
#include "exchange/formats/mjcf.h"
#include "base/arena.h"
#include "base/memory.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf_bodies.h"
#include "exchange/formats/mjcf_couplings.h"
#include "linalg/dense/rotations.h"
#include "linalg/dense/three.h"
#include "model/language/limits.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- classes ------------------------------------------------------------------------------------------- */

static kmp_mjcf_class *find(const kmp_mjcf *m, const char *name)
{
    kmp_mjcf_class *c = m->classes;
    while (c && strcmp(c->name, name) != 0)
        c = c->next;
    return c;
}

static void read_class(kmp_mjcf *m, const kmp_element *e, const kmp_mjcf_class *parent)
{
    kmp_import *im = m->im;
    const char *name = kmp_element_text(e, "class");
    if (!name && parent) {
        kmp_import_complain(im, e->place, "attribute", "class", "is missing here");
        return;
    }
    kmp_mjcf_class *c = find(m, name ? name : "main");
    if (c && parent && c->parent != parent) {
        kmp_import_complain(im, e->place, "the class", name, "exists with other classes around it");
        return;
    }
    if (!c && !parent && m->classes)
        c = m->classes;
    if (!c) {
        kmp_mjcf_class **end = &m->classes;
        c = KMP_ARENA_NEW(im->arena, kmp_mjcf_class, 1);
        if (!c)
            return;
        *c = (kmp_mjcf_class){.name = name ? name : "main", .parent = parent};
        while (*end)
            end = &(*end)->next;
        *end = c;
    }
    const kmp_element **list = kmp_arena_room(im->arena, c->from, c->count, sizeof *list);
    if (!list)
        return;
    c->from = list;
    list[c->count++] = e;
    for (const kmp_element *inner = kmp_element_find(e, "default"); inner; inner = kmp_element_again(inner))
        read_class(m, inner, c);
}

const kmp_mjcf_class *kmp_mjcf_class_of(kmp_mjcf *m, const kmp_element *e, const char *name)
{
    const kmp_mjcf_class *c = find(m, name);
    if (!c && strcmp(name, "main") != 0)
        kmp_import_complain(m->im, e->place, "the class of defaults", name, "does not exist");
    return c;
}

/* -- items --------------------------------------------------------------------------------------------- */

kmp_mjcf_item kmp_mjcf_plain(const kmp_element *e)
{
    return (kmp_mjcf_item){.own = e};
}

static void reverse(const kmp_element **list, int count)
{
    for (int k = 0; k < count / 2; k++) {
        const kmp_element *other = list[k];
        list[k] = list[count - 1 - k];
        list[count - 1 - k] = other;
    }
}

kmp_mjcf_item kmp_mjcf_take(kmp_mjcf *m, const kmp_element *e, const char *word, const kmp_mjcf_class *around)
{
    kmp_mjcf_item item = {.own = e};
    const char *name = kmp_element_text(e, "class");
    const kmp_mjcf_class *c = name ? kmp_mjcf_class_of(m, e, name) : around ? around : m->classes;
    for (; c; c = c->parent)
        for (int k = c->count - 1; k >= 0; k--) {
            const int first = item.count;
            for (const kmp_element *from = c->from[k]->first; from; from = from->next)
                if (word[0] == ' ' ? kmp_import_is_word(word, from->name) : strcmp(word, from->name) == 0) {
                    const kmp_element **list = kmp_arena_room(m->im->arena, item.defaults, item.count, sizeof *list);
                    if (!list)
                        return item;
                    item.defaults = list;
                    list[item.count++] = from;
                }
            reverse(item.defaults + first, item.count - first); /* the last one of a file takes effect last */
        }
    return item;
}

const char *kmp_mjcf_text(const kmp_mjcf_item *item, const char *key)
{
    const char *text = kmp_element_text(item->own, key);
    for (int k = 0; !text && k < item->count; k++)
        text = kmp_element_text(item->defaults[k], key);
    return text;
}

int kmp_mjcf_numbers(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, int least, int most, double *values)
{
    int count = 0;
    for (int k = item->count - 1; k >= -1; k--) {
        int read = kmp_import_read_numbers(m->im, k < 0 ? item->own : item->defaults[k], key, least, most, values);
        count = read > count ? read : count;
    }
    return count;
}

double kmp_mjcf_number(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, double absent)
{
    kmp_mjcf_numbers(m, item, key, 1, 1, &absent);
    return absent;
}

bool kmp_mjcf_flag(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, bool absent)
{
    const char *text = kmp_mjcf_text(item, key);
    if (text && strcmp(text, "true") != 0 && strcmp(text, "false") != 0)
        kmp_import_complain(m->im, item->own->place, key, text, "is neither 'true' nor 'false'");
    return text ? strcmp(text, "true") == 0 : absent;
}

/* -- frames -------------------------------------------------------------------------------------------- */

/* From x, and from y without its part along x. False: no such axes. */
static bool set_axes(const double *x, const double *y, double r[3][3])
{
    double a[3], b[3], length = sqrt(kmp_dot3(x, x));
    for (int k = 0; k < 3; k++)
        a[k] = length > 0 ? x[k] / length : 0;
    double along = kmp_dot3(a, y);
    for (int k = 0; k < 3; k++)
        b[k] = y[k] - along * a[k];
    double across = sqrt(kmp_dot3(b, b));
    if (!(length > 0) || !(across > 0))
        return false;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        r[k][0] = a[k];
        r[k][1] = b[k] / across;
        r[k][2] = (a[i] * b[j] - a[j] * b[i]) / across;
    }
    return true;
}

bool kmp_mjcf_along(const double z[3], double r[3][3])
{
    double axis[3] = {-z[1], z[0], 0}, across = hypot(z[0], z[1]);
    if (!(across > 0))
        axis[0] = 1;
    return (across > 0 || z[2] != 0) && kmp_frame_about(axis, atan2(across, z[2]), r);
}

static const struct {
    const char *key;
    int count;
} ways[] = {{"axisangle", 4}, {"euler", 3}, {"xyaxes", 6}, {"zaxis", 3}, {"quat", 4}};

enum { QUAT = 4, WAYS };

/* The way that an element gives its orientation in, -1: none. */
static int way_of(kmp_mjcf *m, const kmp_element *e)
{
    int found = -1;
    for (int k = 0; k < WAYS; k++) {
        if (!kmp_element_text(e, ways[k].key))
            continue;
        if (found >= 0)
            kmp_import_complain(m->im, e->place, "attribute", ways[k].key, "is a second orientation: give one");
        found = k;
    }
    return found;
}

/* Each letter is a rotation about an axis: a small one of the turned axes, a capital one of the axes around. */
static void turn_in_order(const kmp_mjcf *m, const double angle[3], double r[3][3])
{
    double whole[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int k = 0; k < 3; k++) {
        bool fixed = m->order[k] < 'a';
        int axis = m->order[k] - (fixed ? 'X' : 'x');
        double rpy[3] = {0}, step[3][3];
        rpy[axis] = angle[k] * m->angle;
        kmp_frame_rotate(rpy, step);
        if (fixed)
            kmp_product3(step, false, whole, whole);
        else
            kmp_product3(whole, false, step, whole);
    }
    memcpy(r, whole, sizeof whole);
}

kmp_pose kmp_mjcf_pose(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    kmp_pose f = kmp_frame_none();
    double v[6] = {0};
    const kmp_element *from = item->own;
    int way = way_of(m, from);
    for (int k = 0; way < 0 && k < item->count; k++) {
        from = item->defaults[k];
        way = way_of(m, from);
    }
    kmp_mjcf_numbers(m, item, "pos", 3, 3, f.p);
    if (way < 0 || kmp_import_read_numbers(m->im, from, ways[way].key, ways[way].count, ways[way].count, v) == 0)
        return f;
    bool good = true;
    if (way == QUAT)
        good = kmp_frame_turn(v, f.r);
    else if (strcmp(ways[way].key, "axisangle") == 0)
        good = kmp_frame_about(v, v[3] * m->angle, f.r);
    else if (strcmp(ways[way].key, "euler") == 0)
        turn_in_order(m, v, f.r);
    else
        good = strcmp(ways[way].key, "zaxis") == 0 ? kmp_mjcf_along(v, f.r) : set_axes(v, v + 3, f.r);
    if (!good)
        kmp_import_complain(m->im, from->place, ways[way].key, kmp_element_text(from, ways[way].key),
                            "gives no orientation: its length is zero, or its axes are parallel");
    const kmp_pose none = kmp_frame_none(); /* entries of multiples of a right angle become exact */
    return kmp_frame_in(&none, &f);
}

/* -- included files ------------------------------------------------------------------------------------ */

typedef struct inclusion {
    kmp_import *im;
    kmp_mjcf_names files; /* that have been read */
} inclusion;

/* The outermost element of a file in the folder of the model; NULL after a complaint. */
static const kmp_element *load(inclusion *in, const kmp_element *include)
{
    kmp_import *im = in->im;
    const char *name = kmp_import_attribute(im, include, "file");
    const kmp_element *root = NULL;
    int number;
    size_t length;
    if (!name)
        return NULL;
    if (kmp_mjcf_is_taken(&in->files, im->arena, name)) {
        kmp_import_complain(im, include->place, "the file", name, "is included twice");
        return NULL;
    }
    char *text = im->beside->read(im->beside->user, include->place, im->model->place.file, name, &number, &length);
    if (!text) {
        im->status = KEMPE_E_INPUT;
        return NULL;
    }
    kmp_mjcf_take_name(&in->files, im->arena, name);
    kempe_status status = kmp_xml_load(im->context, im->arena, im->beside->name(im->beside->user, number), number, text,
                                       length, NULL, &root);
    kmp_free(text);
    if (status != KEMPE_OK)
        im->status = status;
    return root;
}

/* The elements of another file take the place of the element `include`. Attributes are elements without others. */
static void include_all(inclusion *in, kmp_element *e, int depth)
{
    if (depth > KMP_MOST_ELEMENTS) {
        kmp_import_complain(in->im, e->place, "the element", e->name, "is nested too deeply in included files");
        return;
    }
    for (kmp_element **at = &e->first; *at && in->im->status == KEMPE_OK;) {
        kmp_element *child = *at;
        if (strcmp(child->name, "include") != 0) {
            include_all(in, child, depth + 1);
            e->last = child;
            at = &child->next;
            continue;
        }
        const kmp_element *root = load(in, child);
        if (!root)
            return;
        if (root->first) {
            root->last->next = child->next;
            *at = root->first;
        } else
            *at = child->next;
    }
}

/* -- settings ------------------------------------------------------------------------------------------ */

static void read_compiler(kmp_mjcf *m, const kmp_element *e)
{
    kmp_import *im = m->im;
    kmp_mjcf_item item = kmp_mjcf_plain(e);
    const char *angle = kmp_element_text(e, "angle"), *order = kmp_element_text(e, "eulerseq"),
               *inertia = kmp_element_text(e, "inertiafromgeom"), *coordinate = kmp_element_text(e, "coordinate");
    if (angle && strcmp(angle, "radian") != 0 && strcmp(angle, "degree") != 0)
        kmp_import_complain(im, e->place, "angle", angle, "is neither 'degree' nor 'radian'");
    else if (angle)
        m->angle = strcmp(angle, "radian") == 0 ? 1 : 3.14159265358979323846 / 180;
    if (order && (strlen(order) != 3 || strspn(order, "xyzXYZ") != 3))
        kmp_import_complain(im, e->place, "eulerseq", order, "is not three letters of x, y, z, X, Y, Z");
    else if (order)
        memcpy(m->order, order, 3);
    if (inertia)
        m->inertia_from_geoms = strcmp(inertia, "auto") == 0                        ? KMP_MJCF_WHERE_ABSENT
                                : kmp_mjcf_flag(m, &item, "inertiafromgeom", false) ? KMP_MJCF_ALWAYS
                                                                                    : KMP_MJCF_NEVER;
    if (coordinate && strcmp(coordinate, "local") != 0)
        kmp_import_complain(im, e->place, "coordinate", coordinate, "is not read: MuJoCo 2.3.3 saves with 'local'");
    kmp_import_read_numbers(im, e, "inertiagrouprange", 2, 2, m->groups);
    m->ranges_count = kmp_mjcf_flag(m, &item, "autolimits", m->ranges_count);
    if (kmp_import_read_number(im, e, "settotalmass", -1) > 0)
        kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, "settotalmass",
                             "'settotalmass' is not read: it scales all masses");
    static const char *const folders[] = {"assetdir", "meshdir"}; /* the second one comes first */
    for (int k = 0; k < 2; k++)
        if (kmp_element_text(e, folders[k]))
            m->meshes = kmp_element_text(e, folders[k]);
}

static void read_flags(const kmp_element *flag, const char *key, bool *value)
{
    const char *text = kmp_element_text(flag, key);
    if (text)
        *value = strcmp(text, "disable") != 0;
}

static void read_settings(kmp_mjcf *m)
{
    kmp_import *im = m->im;
    double gravity[3] = {0, 0, -9.81};
    static const double none[3] = {0};
    for (const kmp_element *e = kmp_element_find(im->model, "compiler"); e; e = kmp_element_again(e))
        read_compiler(m, e);
    for (const kmp_element *e = kmp_element_find(im->model, "option"); e; e = kmp_element_again(e)) {
        const kmp_element *flag = kmp_element_find(e, "flag");
        kmp_import_read_numbers(im, e, "gravity", 3, 3, gravity);
        read_flags(flag, "gravity", &m->has_gravity);
        read_flags(flag, "spring", &m->has_springs);
        read_flags(flag, "damper", &m->has_dampers);
        read_flags(flag, "frictionloss", &m->has_friction);
        read_flags(flag, "equality", &m->has_equalities);
        read_flags(flag, "limit", &m->has_limits);
        read_flags(flag, "actuation", &m->has_actuators);
        read_flags(flag, "clampctrl", &m->has_clamps);
        bool passive = true, constraint = true;
        read_flags(flag, "passive", &passive);
        read_flags(flag, "constraint", &constraint);
        m->has_springs = m->has_springs && passive;
        m->has_dampers = m->has_dampers && passive;
        m->has_equalities = m->has_equalities && constraint;
        m->has_friction = m->has_friction && constraint;
        m->has_limits = m->has_limits && constraint;
    }
    kmp_import_vector(im, im->root, im->model->place, "gravity", m->has_gravity ? gravity : none);
}

/* -- models -------------------------------------------------------------------------------------------- */

void kmp_mjcf_convert(kmp_import *im)
{
    kmp_mjcf m = {.im = im,
                  .angle = 3.14159265358979323846 / 180,
                  .order = "xyz",
                  .inertia_from_geoms = KMP_MJCF_WHERE_ABSENT,
                  .groups = {0, 5},
                  .ranges_count = true,
                  .has_equalities = true,
                  .has_springs = true,
                  .has_dampers = true,
                  .has_friction = true,
                  .has_gravity = true,
                  .has_limits = true,
                  .has_actuators = true,
                  .has_clamps = true};
    inclusion in = {.im = im};
    include_all(&in, (kmp_element *)im->model, 0);
    if (im->status != KEMPE_OK) {
        im->model = NULL; /* it is incomplete */
        return;
    }
    const char *name = kmp_element_text(im->model, "model");
    if (name)
        kmp_import_word(im, im->root, im->model->place, "name", name);
    read_settings(&m);
    for (const kmp_element *e = kmp_element_find(m.im->model, "default"); e; e = kmp_element_again(e))
        read_class(&m, e, NULL);
    kmp_mjcf_add_bodies(&m);
    kmp_mjcf_add_equalities(&m);
    kmp_mjcf_add_tendons(&m);
    kmp_mjcf_add_actuators(&m);
}
