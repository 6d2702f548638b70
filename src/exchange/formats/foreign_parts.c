/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts that foreign models of robots have in common. Meshes are only pictures. A package of ROS is a folder: its path
 * is not in the file, so that it is looked for in the folder of the model and in the folders around it. */
#include "exchange/formats/foreign_parts.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "model/data/shape.h"
#include "platform/platform.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* -- attributes ---------------------------------------------------------------------------------------- */

const char *kmp_import_attribute(kmp_import *im, const kmp_element *e, const char *key)
{
    const char *text = kmp_element_text(e, key);
    if (!text)
        kmp_import_complain(im, e->place, "attribute", key, "is missing here");
    return text;
}

const char *kmp_import_name(kmp_import *im, const kmp_element *e, const char *key)
{
    const char *text = kmp_import_attribute(im, e, key);
    return text ? kmp_import_clean(im, text) : NULL;
}

/* Reads a number; returns the text behind it, NULL: it is none. */
static const char *read_number(const char *text, double *value)
{
    text += strspn(text, " \t\r\n");
    bool negative = *text == '-';
    text += *text == '-' || *text == '+';
    size_t length = kmp_text_to_number(text, value);
    *value = negative ? -*value : *value;
    return length > 0 && isfinite(*value) ? text + length : NULL;
}

int kmp_import_read_numbers(kmp_import *im, const kmp_element *e, const char *key, int least, int most, double *values)
{
    const char *text = kmp_element_text(e, key), *at = text;
    double read[16];
    int count = 0;
    while (at && count < most && at[strspn(at, " \t\r\n")]) {
        at = read_number(at, &read[count]);
        count++;
    }
    if (!text)
        return 0;
    if (!at || at[strspn(at, " \t\r\n")] || count < least) {
        const char *are = most == 1       ? "is not one number"
                          : least == most ? kmp_arena_printf(im->arena, "are not %d numbers", most)
                                          : kmp_arena_printf(im->arena, "are not %d to %d numbers", least, most);
        kmp_import_complain(im, e->place, key, text, are ? are : "");
        return 0;
    }
    memcpy(values, read, (size_t)count * sizeof *values);
    return count;
}

double kmp_import_read_number(kmp_import *im, const kmp_element *e, const char *key, double absent)
{
    kmp_import_read_numbers(im, e, key, 1, 1, &absent);
    return absent;
}

/* -- names --------------------------------------------------------------------------------------------- */

static int in_order(const void *a, const void *b)
{
    const struct kmp_import_entry *x = a, *y = b;
    int order = strcmp(x->name, y->name);
    return order ? order : (x->number > y->number) - (x->number < y->number);
}

kmp_import_index kmp_import_index_of(kmp_import *im, int count, const char *(*name)(const void *list, int k),
                                     const void *list)
{
    kmp_import_index index = {.entry = kmp_arena_alloc(im->arena, (size_t)count + 1, sizeof *index.entry)};
    for (int k = 0; index.entry && k < count; k++)
        if (name(list, k))
            index.entry[index.count++] = (struct kmp_import_entry){name(list, k), k};
    if (index.count > 0)
        qsort(index.entry, (size_t)index.count, sizeof *index.entry, in_order);
    return index;
}

int kmp_import_index_find(const kmp_import_index *index, const char *name)
{
    int low = 0, high = index->count;
    while (low < high) {
        int middle = (low + high) / 2;
        if (strcmp(index->entry[middle].name, name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low < index->count && strcmp(index->entry[low].name, name) == 0 ? index->entry[low].number : -1;
}

/* -- bodies -------------------------------------------------------------------------------------------- */

kmp_yaml *kmp_import_body(kmp_import *im, const char *name)
{
    return (kmp_yaml *)kmp_yaml_get(kmp_yaml_get(im->root, "bodies"), name);
}

kmp_yaml *kmp_import_add_body(kmp_import *im, const kmp_element *from, const char *name)
{
    static const double zero[3] = {0};
    kmp_yaml *body = kmp_import_map(im, from->place);
    kmp_import_vector(im, kmp_import_part(im, body, "points", KMP_YAML_MAP), from->place, "origin", zero);
    kmp_import_add(im, "bodies", from, name, body);
    return kmp_import_body(im, name) == body ? body : NULL;
}

/* The mapping {x: .., y: ..} of the axes of a frame. */
static kmp_yaml *axes_of(kmp_import *im, kmp_place place, const kmp_pose *f)
{
    kmp_yaml *axes = kmp_import_map(im, place);
    for (int k = 0; k < 2; k++) {
        const double column[3] = {f->r[0][k], f->r[1][k], f->r[2][k]};
        kmp_import_vector(im, axes, place, k == 0 ? "x" : "y", column);
    }
    return axes;
}

const char *kmp_import_point(kmp_import *im, kmp_place place, const char *body, const char *name, const kmp_pose *f)
{
    kmp_yaml *map = !body                         ? NULL
                    : strcmp(body, "ground") == 0 ? kmp_import_part(im, im->root, "ground", KMP_YAML_MAP)
                                                  : kmp_import_body(im, body);
    if (!map || !name)
        return NULL;
    kmp_yaml *points = kmp_import_part(im, map, "points", KMP_YAML_MAP);
    while (name && kmp_yaml_get(points, name))
        name = kmp_arena_printf(im->arena, "%s_", name);
    if (!name)
        return NULL;
    kmp_yaml *at = kmp_import_numbers(im, place, 3, f->p), *point = at;
    if (kmp_frame_is_turned(f)) {
        point = kmp_import_map(im, place);
        kmp_import_put(im, point, place, "at", at);
        kmp_import_put(im, point, place, "axes", axes_of(im, place, f));
    }
    kmp_import_put(im, points, place, name, point);
    return kmp_arena_printf(im->arena, "%s.%s", body, name);
}

kmp_yaml *kmp_import_direction(kmp_import *im, kmp_place place, const char *name, const double axis[3])
{
    double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (!(length > 0))
        kmp_import_complain(im, place, "the axis of", name, "is zero: it needs a direction");
    return kmp_import_numbers(im, place, 3, axis);
}

void kmp_import_read_tensor(kmp_import *im, const kmp_element *inertia, double moment, double tensor[3][3])
{
    static const char *const keys[3][3] = {{"ixx", "ixy", "ixz"}, {"ixy", "iyy", "iyz"}, {"ixz", "iyz", "izz"}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            tensor[i][j] = kmp_import_read_number(im, inertia, keys[i][j], i == j ? moment : 0);
}

void kmp_import_mass(kmp_import *im, kmp_yaml *body, kmp_place place, double mass, const kmp_pose *centre,
                     const double tensor[3][3])
{
    static const char *const names[3][3] = {{"xx", "xy", "xz"}, {"", "yy", "yz"}, {"", "", "zz"}};
    bool turned = kmp_frame_is_turned(centre);
    kmp_yaml *map = tensor ? kmp_import_map(im, place) : NULL;
    double half[3][3], about[3][3];
    kmp_import_value(im, body, place, "mass", mass);
    kmp_import_vector(im, body, place, "com", centre->p);
    if (!map)
        return;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            half[i][j] =
                centre->r[i][0] * tensor[0][j] + centre->r[i][1] * tensor[1][j] + centre->r[i][2] * tensor[2][j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            about[i][j] = half[i][0] * centre->r[j][0] + half[i][1] * centre->r[j][1] + half[i][2] * centre->r[j][2];
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            kmp_import_value(im, map, place, names[i][j], turned ? about[i][j] : tensor[i][j]);
    kmp_import_word(im, map, place, "as_given", "yes");
    kmp_import_put(im, body, place, "inertia", map);
}

const char *kmp_import_colour(kmp_import *im, const double rgb[3])
{
    unsigned part[3];
    for (int k = 0; k < 3; k++)
        part[k] = (unsigned)lround(255 * fmin(1, fmax(0, rgb[k])));
    return kmp_arena_printf(im->arena, "#%02x%02x%02x", part[0], part[1], part[2]);
}

/* The place of a picture, with its axes or its axis where it is turned, and its colour. */
static void add_picture(kmp_import *im, kmp_yaml *body, kmp_yaml *map, const kmp_pose *at, bool has_axes, bool has_axis,
                        const char *colour)
{
    if (!map)
        return;
    const double axis[3] = {at->r[0][2], at->r[1][2], at->r[2][2]};
    kmp_import_vector(im, map, map->place, "at", at->p);
    if (kmp_frame_is_turned(at) && has_axes)
        kmp_import_put(im, map, map->place, "axes", axes_of(im, map->place, at));
    if (kmp_frame_is_turned(at) && has_axis)
        kmp_import_vector(im, map, map->place, "axis", axis);
    if (colour)
        kmp_import_word(im, map, map->place, "colour", colour);
    kmp_yaml_append(im->arena, kmp_import_part(im, body, "shape", KMP_YAML_LIST), NULL, map);
}

kmp_yaml *kmp_import_shape(kmp_import *im, kmp_yaml *body, kmp_place place, kmp_import_solid solid,
                           const double size[3], const kmp_pose *at, const char *colour)
{
    static const char *const words[] = {"box", "sphere", "cylinder", "capsule", "ellipsoid"};
    kmp_yaml *map = kmp_import_map(im, place);
    bool round = solid == KMP_SOLID_CYLINDER || solid == KMP_SOLID_CAPSULE;
    bool three = solid == KMP_SOLID_BOX || solid == KMP_SOLID_ELLIPSOID;
    if (three)
        kmp_import_vector(im, map, place, words[solid], size);
    else
        kmp_import_value(im, map, place, words[solid], size[round ? 1 : 0]);
    if (round)
        kmp_import_value(im, map, place, "radius", size[0]);
    add_picture(im, body, map, at, three, round, colour);
    return map;
}

kmp_shape kmp_import_heavy(kmp_import_solid solid, const double size[3], const kmp_pose *at, double matter,
                           bool by_density)
{
    static const kmp_shape_kind kinds[] = {[KMP_SOLID_BOX] = KMP_SHAPE_BOX,
                                           [KMP_SOLID_SPHERE] = KMP_SHAPE_SPHERE,
                                           [KMP_SOLID_CYLINDER] = KMP_SHAPE_CYLINDER,
                                           [KMP_SOLID_CAPSULE] = KMP_SHAPE_CAPSULE,
                                           [KMP_SOLID_ELLIPSOID] = KMP_SHAPE_ELLIPSOID,
                                           [KMP_SOLID_MESH] = KMP_SHAPE_MESH};
    kmp_shape shape = {
        .kind = kinds[solid], .heavy = true, .by_density = by_density, .turned = kmp_frame_is_turned(at)};
    shape.matter.value = matter;
    shape.scale.value = 1;
    shape.radius.value = size[0];
    shape.length.value = size[1];
    memcpy(shape.axes, at->r, sizeof shape.axes);
    for (int k = 0; k < 3; k++) {
        shape.edge[k].value = size[k];
        shape.at[k].value = at->p[k];
        shape.along[k].value = at->r[k][2];
    }
    return shape;
}

double kmp_import_weigh(kmp_import *im, int count, const kmp_shape *shapes, kmp_pose *centre, double tensor[3][3])
{
    static const int entry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    kmp_mass_part sum = {.mass.value = 0};
    kmp_shapes_mass(im->arena, count, shapes, &sum);
    *centre = kmp_frame_none();
    for (int i = 0; i < 3; i++) {
        centre->p[i] = sum.com[i].value;
        for (int j = 0; j < 3; j++)
            tensor[i][j] = sum.inertia[entry[i][j]].value;
    }
    return sum.mass.value;
}

/* -- meshes ---------------------------------------------------------------------------------------------- */

enum { MOST_FOLDERS_UP = 8 };

/* A path relative to the model's file, if there is a file. */
static const char *try_path(const kmp_import *im, int up, const char *path)
{
    static const char ups[] = "../../../../../../../../";
    int folder = (int)kmp_path_folder(im->file);
    const char *name = kmp_arena_printf(im->arena, "%.*s%s", 3 * up, ups, path);
    const char *whole = name ? kmp_arena_printf(im->arena, "%.*s%s", folder, im->file, name) : NULL;
    return whole && kmp_path_readable(whole) ? name : NULL;
}

/* The path of a mesh relative to the model's file; NULL: it is not found. */
static const char *find_mesh(const kmp_import *im, const char *uri)
{
    const char *scheme = strstr(uri, "://"), *path = scheme ? scheme + 3 : uri, *found = NULL;
    bool package = scheme && strncmp(uri, "file:", 5) != 0;
    const char *inside = package ? strchr(path, '/') : NULL; /* of the package */
    if (!package && kmp_path_is_whole(path))
        return kmp_path_readable(path) ? path : NULL;
    for (int up = 0; !found && up <= (package ? MOST_FOLDERS_UP : 0); up++) {
        found = !kmp_path_is_whole(path) ? try_path(im, up, path) : NULL;
        if (!found && inside && inside[1])
            found = try_path(im, up, inside + 1);
    }
    return found;
}

bool kmp_import_read_mesh(kmp_import *im, const char *uri, kmp_mesh *mesh, kmp_text *why)
{
    const char *found = find_mesh(im, uri);
    int folder = found && !kmp_path_is_whole(found) ? (int)kmp_path_folder(im->file) : 0;
    const char *path = found ? kmp_arena_printf(im->arena, "%.*s%s", folder, im->file, found) : NULL;
    kempe_context *aside = path ? kempe_context_new() : NULL;
    char *text = NULL;
    size_t length;
    bool good = false;
    if (!found)
        kmp_text_printf(why, "the file '%s' is not found", uri);
    else if (!aside || kmp_file_read(aside, KMP_FILE_MESH, path, &text, &length) != KEMPE_OK)
        kmp_text_printf(why, "the file '%s' cannot be read", uri);
    else
        good = kmp_mesh_read(im->arena, path, text, length, mesh, why);
    kmp_free(text);
    kempe_context_free(aside);
    return good;
}

void kmp_import_mesh(kmp_import *im, kmp_yaml *body, kmp_place place, const char *uri, const double scale[3],
                     const kmp_pose *at, const char *colour)
{
    const char *ending = kmp_file_ending(uri), *path = NULL;
    bool known = strcasecmp(ending, ".stl") == 0 || strcasecmp(ending, ".obj") == 0;
    bool even = scale[0] == scale[1] && scale[0] == scale[2] && scale[0] > 0;
    if (known && even)
        path = find_mesh(im, uri);
    if (!path) {
        kmp_import_leave_out(im, place, KMP_PART_REMARK, "mesh", "mesh '%s' is not in the picture: %s", uri,
                             !known  ? "a mesh is a file .stl or .obj"
                             : !even ? "a mesh has one positive scale"
                                     : "it is not found in the model's folder or a folder around it");
        return;
    }
    kmp_yaml *map = kmp_import_map(im, place);
    kmp_import_word(im, map, place, "mesh", path);
    if (scale[0] != 1)
        kmp_import_value(im, map, place, "scale", scale[0]);
    add_picture(im, body, map, at, true, false, colour);
}

/* -- joints and loops ---------------------------------------------------------------------------------- */

void kmp_import_joint(kmp_import *im, kmp_yaml *body, kmp_place place, const char *name, const char *at,
                      const char *kind, const kmp_yaml *axis)
{
    kmp_yaml *map = kmp_import_map(im, place);
    kmp_import_word(im, map, place, "name", name);
    kmp_import_word(im, map, place, "at", at);
    if (axis)
        kmp_import_put(im, map, place, kind, axis);
    else
        kmp_import_word(im, map, place, kind, strcmp(kind, "weld") == 0 ? "yes" : "x");
    kmp_import_put(im, body, place, "joint", map);
}

/* The force JOINT_WORD: {joint: JOINT, LAW: {..}}; returns the inner mapping. JOINT may be JOINT.1, then it is
 * JOINT_1_WORD. */
static kmp_yaml *add_force(kmp_import *im, const kmp_element *from, const char *joint, const char *word,
                           const char *law)
{
    kmp_yaml *map = kmp_import_map(im, from->place), *inside = kmp_import_map(im, from->place);
    kmp_import_word(im, map, from->place, "joint", joint);
    kmp_import_put(im, map, from->place, law, inside);
    const char *name = kmp_arena_printf(im->arena, "%s_%s", joint, word);
    kmp_import_add(im, "forces", from, name ? kmp_import_clean(im, name) : NULL, map);
    return inside;
}

void kmp_import_spring(kmp_import *im, const kmp_element *from, const char *joint, const char *word, double stiffness,
                       double rest, double damping)
{
    if (stiffness == 0 && damping == 0)
        return;
    kmp_yaml *spring = add_force(im, from, joint, word, "spring");
    kmp_import_value(im, spring, from->place, "stiffness", stiffness);
    if (rest != 0 && stiffness != 0)
        kmp_import_value(im, spring, from->place, "rest", rest);
    if (damping != 0)
        kmp_import_value(im, spring, from->place, "damping", damping);
}

void kmp_import_friction(kmp_import *im, const kmp_element *from, const char *joint, bool slides, double level)
{
    if (level != 0)
        kmp_import_value(im, add_force(im, from, joint, "friction", "friction"), from->place,
                         slides ? "force" : "torque", level);
}

void kmp_import_limits(kmp_import *im, const kmp_element *from, const char *name, const char *length, double lower,
                       double upper)
{
    static const char *const words[2] = {"lower", "upper"};
    const double limit[2] = {lower, upper};
    if (!(lower < upper) || (isinf(lower) && isinf(upper)))
        return;
    if (!kmp_context_has_limits(im->context)) {
        if (im->limited++ == 0)
            im->first_limit = from->place;
        return;
    }
    for (int k = 0; k < 2; k++) {
        if (isinf(limit[k]))
            continue;
        kmp_yaml *map = kmp_import_map(im, from->place);
        if (length) {
            kmp_import_word(im, map, from->place, "gap",
                            k == 0 ? kmp_arena_printf(im->arena, "%s - %.17g", length, limit[k])
                                   : kmp_arena_printf(im->arena, "%.17g - (%s)", limit[k], length));
        } else {
            kmp_import_word(im, map, from->place, "joint", name);
            kmp_import_value(im, map, from->place, words[k], limit[k]);
        }
        kmp_import_word(im, map, from->place, "restitution", "0");
        kmp_import_add(im, "contacts", from, kmp_arena_printf(im->arena, "%s_%s", name, words[k]), map);
    }
}

void kmp_import_coupler(kmp_import *im, const kmp_element *from, const char *name, int count, const char *const *joint,
                        const double *factor, double equals)
{
    kmp_yaml *map = kmp_import_map(im, from->place), *factors = kmp_import_map(im, from->place);
    for (int k = 0; k < count; k++)
        kmp_import_value(im, factors, from->place, joint[k], factor[k]);
    kmp_import_put(im, map, from->place, "coupler", factors);
    kmp_import_value(im, map, from->place, "equals", equals);
    kmp_import_add(im, "loops", from, name, map);
}

void kmp_import_hold(kmp_import *im, kmp_place place, const char *coordinate)
{
    kmp_yaml *start = kmp_import_part(im, im->root, "start", KMP_YAML_MAP);
    kmp_yaml_append(im->arena, kmp_import_part(im, start, "hold", KMP_YAML_LIST), NULL,
                    kmp_yaml_word(im->arena, place, coordinate));
}

kmp_yaml *kmp_import_between(kmp_import *im, const kmp_element *from, const char *section, const char *name,
                             const char *kind, const char *const points[2])
{
    kmp_yaml *map = kmp_import_map(im, from->place), *list = kmp_yaml_new(im->arena, KMP_YAML_LIST, from->place);
    for (int end = 0; end < 2; end++)
        kmp_yaml_append(im->arena, list, NULL, kmp_yaml_word(im->arena, from->place, points[end]));
    kmp_import_put(im, map, from->place, kind, list);
    kmp_import_add(im, section, from, name, map);
    return map;
}

void kmp_import_loop(kmp_import *im, const kmp_element *from, const char *name, const char *kind,
                     const char *const points[2], const kmp_yaml *axis)
{
    kmp_yaml *map = kmp_import_between(im, from, "loops", name, kind, points);
    if (axis)
        kmp_import_put(im, map, from->place, "axis", axis);
}
