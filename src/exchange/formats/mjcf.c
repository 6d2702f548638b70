/* SPDX-License-Identifier: BSD-3-Clause */
/* MuJoCo's format (docs/mjcf.md): other files that the model includes, settings, and the order in which its parts
 * become a document. */
#include "exchange/formats/mjcf.h"
#include "base/memory.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf_bodies.h"
#include "exchange/formats/mjcf_defaults.h"
#include "exchange/formats/mjcf_equality.h"
#include "exchange/formats/mjcf_tendons.h"
#include "model/data/model.h"
#include "model/language/limits.h"
#include <string.h>

/* -- included files ------------------------------------------------------------------------------------ */

typedef struct inclusion {
    kmp_import *im;
    kmp_mjcf_names files; /* that have been read */
} inclusion;

/* The outermost element of a file beside the model; NULL after a complaint. */
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
    kmp_import_put(im, im->root, im->model->place, "gravity",
                   kmp_import_numbers(im, im->model->place, 3, m->has_gravity ? gravity : none));
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
    kmp_mjcf_read_classes(&m);
    kmp_mjcf_add_bodies(&m);
    kmp_mjcf_add_equalities(&m);
    kmp_mjcf_add_tendons(&m);
    kmp_mjcf_add_actuators(&m);
}
