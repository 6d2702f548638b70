/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes; mass, centre of mass and inertia, and the check that a body can have them. */
#include "model/read/read_mass.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/mesh.h"
#include "model/data/model.h"
#include "model/data/shape.h"
#include "model/language/limits.h"
#include "model/language/number_algebra.h"
#include "model/read/read_bodies.h"
#include "model/read/read_flexible.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

/* -- shapes ------------------------------------------------------------------------------------------ */

/* Shapes of bodies and of the ground. */

static const kmp_key shape_keys[] = {
#include "model/keys/shape_keys.def"
    {0}};

/* A shape that is read, and whose it is. */
typedef struct reading {
    kmp_reader *r;
    const kmp_shape_owner *owner;
    const kmp_yaml *map;
    const char *what;
    kmp_shape *shape;
} reading;

static const char *say_key(const reading *s, const char *key)
{
    return kmp_reader_say(s->r, "%s of %s", key, s->what);
}

/* -- numbers and places ------------------------------------------------------------------------------ */

/* Only parameters are symbols in masses by shapes: a number of a shape has no name, and one of a point moves the
 * point. */
static void drop_symbols(int count, kmp_number *number)
{
    for (int k = 0; k < count; k++)
        number[k].symbol = 0;
}

static bool read_positive(const reading *s, const kmp_yaml *node, const char *key, kmp_number *number)
{
    const bool good =
        kmp_read_ruled(s->r, node, say_key(s, key), kmp_key_dimension(shape_keys, key), KMP_FIELD_POSITIVE, number);
    drop_symbols(good, number);
    return good;
}

/* A point of the same body by its name. */
static const kmp_point *read_point_name(const reading *s, const kmp_yaml *node, const char *what)
{
    kmp_reader *r = s->r;
    const char *word = kmp_read_word(r, node, what);
    if (!word)
        return NULL;
    const char *name = s->owner->origin ? kmp_reader_name(r, node->place.file, word) : word;
    int found = kmp_read_point_of(r, node->place, s->owner->body, name, what);
    return found < 0 ? NULL : &r->model->points[found];
}

/* [x, y, z], or the name of a point (`*point`; else NULL). */
static bool read_place(const reading *s, const kmp_yaml *node, const char *what, kmp_number at[3],
                       const kmp_point **point)
{
    kmp_arena *arena = &s->r->model->arena;
    const kmp_number *origin = s->owner->origin;
    *point = NULL;
    if (node->kind == KMP_YAML_SCALAR && !node->empty) {
        *point = read_point_name(s, node, what);
        if (*point)
            memcpy(at, (*point)->at, sizeof(*point)->at);
        drop_symbols(*point ? 3 : 0, at);
        return *point;
    }
    if (!kmp_read_vector(s->r, node, what, KMP_DIM_LENGTH, at))
        return false;
    drop_symbols(3, at);
    for (int k = 0; origin && k < 3; k++)
        at[k] = kmp_number_add(arena, at[k], origin[k]);
    return true;
}

/* Places in a list, each apart from the one before it; NULL after an error. */
static kmp_number (*read_places(const reading *s, const kmp_yaml *node, const char *key))[3]
{
    kmp_number(*at)[3] = kmp_arena_alloc(&s->r->model->arena, (size_t)node->count, sizeof *at);
    bool good = at;
    const kmp_point *point;
    for (int i = 0; at && i < node->count; i++) {
        const char *what = kmp_reader_say(s->r, "place %d of %s", i + 1, say_key(s, key));
        bool read = read_place(s, node->items[i], what, at[i], &point);
        bool same = read && good && i > 0;
        for (int k = 0; k < 3 && same; k++)
            same = at[i - 1][k].value == at[i][k].value;
        if (same)
            read = kmp_reader_complain(s->r, node->items[i]->place, "%s is the same as the one before it", what);
        good = good && read;
    }
    return good ? at : NULL;
}

/* -- where and how it lies --------------------------------------------------------------------------- */

/* Its centre, and its axes: given ones, else the axes of the point that it is put on, else the axes of the body. */
static bool read_frame(const reading *s)
{
    kmp_shape *shape = s->shape;
    const kmp_yaml *at = kmp_yaml_get(s->map, "at"), *axes = kmp_yaml_get(s->map, "axes");
    const kmp_point *point = NULL;
    for (int k = 0; !at && s->owner->origin && k < 3; k++)
        shape->at[k] = s->owner->origin[k];
    if (at && !read_place(s, at, say_key(s, "at"), shape->at, &point))
        return false;
    for (int k = 0; k < 3; k++)
        shape->axes[k][k] = 1;
    shape->turned = axes || (point && point->turned);
    if (axes)
        return kmp_read_axes(s->r, axes, say_key(s, "axes"), shape->axes);
    if (point && point->turned)
        memcpy(shape->axes, point->axes, sizeof shape->axes);
    return true;
}

/* Between two places: centre, length and direction follow from them. */
static bool read_between(const reading *s, const kmp_yaml *node, const char *key)
{
    kmp_shape *shape = s->shape;
    kmp_arena *arena = &s->r->model->arena;
    static const char *const none[] = {"at", "axis"};
    for (int k = 0; k < 2; k++)
        if (kmp_yaml_get(s->map, none[k]))
            return KMP_COMPLAIN(s, kmp_yaml_get(s->map, none[k]),
                                "a %s between two places has no '%s'; give its length in place of them", key, none[k]);
    kmp_number(*end)[3] = kmp_read_list(s->r, node, say_key(s, key), 2) ? read_places(s, node, key) : NULL;
    kmp_number sum = {.value = 0}, way[3];
    if (!end)
        return false;
    for (int k = 0; k < 3; k++) {
        way[k] = kmp_number_subtract(arena, end[1][k], end[0][k]);
        sum = kmp_number_add(arena, sum, kmp_number_times(arena, way[k], way[k]));
        shape->at[k] = kmp_number_scale(arena, 0.5, kmp_number_add(arena, end[0][k], end[1][k]));
    }
    shape->length = kmp_number_root(arena, sum);
    for (int k = 0; k < 3; k++)
        shape->along[k] = kmp_number_over(arena, way[k], shape->length);
    return true;
}

/* By its length: along an axis of the body, else along z of the shape's axes. */
static bool read_along(const reading *s, const kmp_yaml *node, const char *key)
{
    kmp_shape *shape = s->shape;
    const kmp_yaml *axis = kmp_yaml_get(s->map, "axis");
    double along[3];
    if (!read_positive(s, node, key, &shape->length) || !read_frame(s) ||
        (axis && !kmp_read_axis(s->r, axis, say_key(s, "axis"), along)))
        return false;
    for (int k = 0; k < 3; k++)
        shape->along[k] = (kmp_number){.value = axis ? along[k] : shape->axes[k][2]};
    return true;
}

/* -- kinds ------------------------------------------------------------------------------------------- */

/* Three lengths along its axes: edges of a box, radii of an ellipsoid. */
static bool read_lengths(const reading *s, const kmp_yaml *node)
{
    const char *what = say_key(s, kmp_shape_words[s->shape->kind]);
    if (!kmp_read_vector(s->r, node, what, KMP_DIM_LENGTH, s->shape->edge) || !read_frame(s))
        return false;
    drop_symbols(3, s->shape->edge);
    bool good = true;
    for (int k = 0; k < 3; k++)
        good = kmp_check_rule(s->r, node->items[k], kmp_reader_say(s->r, "component %d of %s", k + 1, what),
                              KMP_FIELD_POSITIVE, s->shape->edge[k].value, "") &&
               good;
    return good;
}

static bool read_sphere(const reading *s, const kmp_yaml *node)
{
    return read_positive(s, node, "sphere", &s->shape->radius) && read_frame(s);
}

static bool read_round(const reading *s, const kmp_yaml *node)
{
    const char *key = kmp_shape_words[s->shape->kind];
    const kmp_yaml *radius = kmp_read_required(s->r, s->map, s->what, "radius");
    bool good = radius && read_positive(s, radius, "radius", &s->shape->radius);
    return (node->kind == KMP_YAML_LIST ? read_between : read_along)(s, node, key) && good;
}

static bool read_line(const reading *s, const kmp_yaml *node)
{
    const kmp_yaml *radius = kmp_yaml_get(s->map, "radius");
    if (!kmp_read_list(s->r, node, say_key(s, "line"), -1) ||
        (radius && !read_positive(s, radius, "radius", &s->shape->radius)))
        return false;
    if (node->count < 2)
        return KMP_COMPLAIN(s, node, "a line needs two places or more");
    s->shape->through = (const kmp_number(*)[3])read_places(s, node, "line");
    s->shape->through_count = node->count;
    return s->shape->through;
}

/* -- meshes ------------------------------------------------------------------------------------------ */

static const kmp_mesh *load_mesh(const reading *s, const kmp_yaml *node, const char *path)
{
    kmp_reader *r = s->r;
    kmp_arena *arena = &r->model->arena;
    kmp_mesh *mesh = KMP_ARENA_NEW(arena, kmp_mesh, 1);
    const char *own = kmp_arena_strdup(arena, path);
    size_t length;
    char *text = mesh && own ? kmp_read_file(r, KMP_FILE_MESH, node, s->what, path, &length) : NULL;
    kmp_text why = {0};
    bool good = text && kmp_mesh_read(arena, own, text, length, mesh, &why);
    if (text && !good && why.length > 0)
        kmp_complain_of(r, node, s->what, "'%s': %s", path, why.s);
    r->scratch.failed = r->scratch.failed || why.failed;
    kmp_text_free(&why);
    kmp_free(text);
    return good ? mesh : NULL;
}

static bool read_mesh(const reading *s, const kmp_yaml *node)
{
    const kmp_yaml *scale = kmp_yaml_get(s->map, "scale");
    double one = 1;
    (void)kmp_key_default(shape_keys, "scale", 1, &one);
    s->shape->scale = (kmp_number){.value = one};
    if (!kmp_read_word(s->r, node, say_key(s, "mesh")) || !read_frame(s) ||
        (scale && !read_positive(s, scale, "scale", &s->shape->scale)))
        return false;
    const char *path = kmp_path_beside(s->r, node->place.file, node->text);
    const kmp_shape *shapes = s->r->model->shapes;
    for (int k = 0; k < s->r->model->shape_count && !s->shape->mesh; k++)
        if (shapes[k].mesh && strcmp(shapes[k].mesh->path, path) == 0)
            s->shape->mesh = shapes[k].mesh; /* a file that another shape has, too, is read once */
    if (!s->shape->mesh)
        s->shape->mesh = load_mesh(s, node, path);
    return s->shape->mesh;
}

/* Keys of other kinds are errors; unknown ones have been reported. */
static bool check_keys(const reading *s)
{
    const char *kind = kmp_shape_words[s->shape->kind], *more = kmp_shape_more[s->shape->kind];
    bool good = true;
    for (int i = 0; i < s->map->count; i++) {
        const kmp_yaml *key = s->map->keys[i];
        if (!kmp_text_behind_word("density mass hole colour opacity", key->text) &&
            !kmp_text_behind_word(more, key->text) && strcmp(key->text, kind) != 0 &&
            kmp_name_find(kmp_key_names(shape_keys), key->text) >= 0)
            good = KMP_COMPLAIN(s, key, "a %s has no '%s'", kind, key->text);
    }
    return good;
}

/* -- what it is made of ------------------------------------------------------------------------------ */

static void read_matter(const reading *s)
{
    kmp_reader *r = s->r;
    const kmp_yaml *density = kmp_yaml_get(s->map, "density"), *mass = kmp_yaml_get(s->map, "mass");
    const kmp_yaml *given = density ? density : mass, *hole = kmp_yaml_get(s->map, "hole");
    s->shape->hole = kmp_is_word(hole, "yes");
    if (hole && !s->shape->hole)
        kmp_complain_of(r, hole, s->what, "a hole is written 'hole: yes'");
    if (density && mass)
        kmp_reader_complain(r, mass->place, "%s has a density, which gives its mass: remove one of the two", s->what);
    else if (given && s->owner->origin)
        kmp_complain_of(r, given, s->what, "the ground has no mass");
    else if (density && s->shape->kind == KMP_SHAPE_LINE)
        kmp_complain_of(r, density, s->what, "a line has no volume; give its mass, or cylinders");
    else if (given && read_positive(s, given, density ? "density" : "mass", &s->shape->matter))
        s->shape->heavy = true;
    s->shape->by_density = density;
    if (s->shape->heavy && s->shape->kind == KMP_SHAPE_MESH) {
        /* Computes the volume of a mesh that has a mass; a mesh that is drawn only may be open. */
        kmp_text why = {0};
        const kmp_yaml *node = kmp_yaml_get(s->map, "mesh");
        bool good = kmp_mesh_enclose(s->shape->mesh, &s->shape->enclosed, &why);
        if (!good && why.length > 0)
            KMP_COMPLAIN(s, node, "'%s' gives no mass: %s", s->shape->mesh->path, why.s);
        if (good && s->shape->enclosed.inward)
            kmp_log(s->r->context, KEMPE_LOG_WARNING,
                    "%s:%d:%d: %s: the triangles of '%s' face inwards; they are turned",
                    s->r->model->source.files[node->place.file], node->place.line, node->place.column, s->what,
                    s->shape->mesh->path);
        s->r->scratch.failed = s->r->scratch.failed || why.failed;
        s->shape->heavy = good;
        kmp_text_free(&why);
    }
}

static void read_looks(const reading *s)
{
    kmp_reader *r = s->r;
    const kmp_yaml *colour = kmp_yaml_get(s->map, "colour"), *opacity = kmp_yaml_get(s->map, "opacity");
    const char *what = say_key(s, "opacity");
    kmp_number number;
    s->shape->colour = -1;
    s->shape->opacity = 1;
    if (colour && colour->empty) {
        kmp_complain_of(r, colour, s->what, "a colour is a name, or \"#rrggbb\" in quotes");
    } else if (colour && kmp_read_word(r, colour, say_key(s, "colour"))) {
        s->shape->colour = kmp_colour_find(colour->text);
        kmp_nearest nearest = kmp_nearest_of(colour->text, kmp_colour_names);
        if (s->shape->colour < 0)
            kmp_reader_complain_near(r, colour->place, &nearest, "%s: unknown colour '%s'", s->what, colour->text);
    }
    if (!opacity || !kmp_read_number(r, opacity, what, KMP_DIM_NUMBER, &number))
        return;
    if (!(number.value > 0) || number.value > 1)
        kmp_reader_complain(r, opacity->place, "%s is %.6g: it must be more than 0 and at most 1", what, number.value);
    s->shape->opacity = number.value;
}

/* -- all of a body ----------------------------------------------------------------------------------- */

static void read_shape(kmp_reader *r, const kmp_shape_owner *owner, const kmp_yaml *map, const char *what)
{
    static const kmp_name_list kinds = {kmp_shape_words, sizeof *kmp_shape_words, KMP_SHAPE_KINDS};
    static bool (*const read[])(const reading *, const kmp_yaml *) = {
        [KMP_SHAPE_BOX] = read_lengths,    [KMP_SHAPE_ELLIPSOID] = read_lengths, [KMP_SHAPE_SPHERE] = read_sphere,
        [KMP_SHAPE_CYLINDER] = read_round, [KMP_SHAPE_CAPSULE] = read_round,     [KMP_SHAPE_LINE] = read_line,
        [KMP_SHAPE_MESH] = read_mesh};
    kempe_model *model = r->model;
    if (!KMP_ARENA_GROW(&model->arena, model->shapes, model->shape_count) || !kmp_read_map(r, map, what, shape_keys))
        return;
    reading s = {r, owner, map, what, &model->shapes[model->shape_count]};
    int kind = kmp_read_one_key(r, map, what, kinds);
    *s.shape = (kmp_shape){.kind = kind < 0 ? KMP_SHAPE_BOX : (kmp_shape_kind)kind, .body = owner->body};
    if (kind < 0 || !check_keys(&s) || !read[kind](&s, kmp_yaml_get(map, kmp_shape_words[kind])))
        return;
    read_matter(&s);
    read_looks(&s);
    model->shape_count++;
}

void kmp_read_shapes(kmp_reader *r, const kmp_yaml *map, const kmp_shape_owner *owner)
{
    const kmp_yaml *node = kmp_yaml_get(map, "shape");
    if (!node)
        return;
    if (node->kind != KMP_YAML_LIST) {
        read_shape(r, owner, node, kmp_reader_say(r, "the shape of %s", owner->name));
        return;
    }
    if (node->count == 0 || node->count > KMP_MOST_SHAPES)
        kmp_reader_complain(r, node->place, "the shapes of %s are %d: 1 to %d are possible", owner->name, node->count,
                            KMP_MOST_SHAPES);
    for (int i = 0; i < node->count && node->count <= KMP_MOST_SHAPES; i++)
        read_shape(r, owner, node->items[i], kmp_reader_say(r, "shape %d of %s", i + 1, owner->name));
}

static const kmp_key inertia_keys[] = {
#include "model/keys/inertia_keys.def"
    {0}};

/* -- inertia ----------------------------------------------------------------------------------------- */

/* Published data is rounded: a flat body's xx + yy may fall short of zz by that much. */
static const double slack = 1e-4;

/* A body's second moments P = tr(I)/2 - I are a sum of m r r' and so have no negative principal minor; then I has none
 * either, and its principal moments fulfil the triangle inequality. P is scaled to trace 1. */
static bool is_possible(const kmp_number inertia[6])
{
    double half = (inertia[0].value + inertia[1].value + inertia[2].value) / 2;
    double p[6];
    bool nothing = true;
    for (int i = 0; i < 6; i++)
        nothing = nothing && inertia[i].value == 0;
    if (!(half > 0))
        return nothing;
    for (int i = 0; i < 6; i++)
        p[i] = ((i < 3 ? half : 0) - inertia[i].value) / half;
    double xx = p[0], yy = p[1], zz = p[2], xy = p[3], xz = p[4], yz = p[5];
    double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    return xx >= -slack && yy >= -slack && zz >= -slack && xx * yy - xy * xy >= -slack && xx * zz - xz * xz >= -slack &&
           yy * zz - yz * yz >= -slack && determinant >= -slack;
}

static bool is_as_given(kmp_reader *r, const kmp_yaml *node)
{
    const kmp_yaml *word = kmp_yaml_get(node, "as_given");
    if (word && !kmp_is_word(word, "yes"))
        kmp_reader_complain(r, word->place, "to accept an impossible inertia, write 'as_given: yes'");
    return word;
}

static void say_impossible(kmp_reader *r, const kmp_yaml *node, kmp_place place, const kmp_body *body, const char *why)
{
    const char *sentence = kmp_reader_say(r, "the inertia of body '%s' is impossible: %s", body->name, why);
    if (is_as_given(r, node))
        kmp_log(r->context, KEMPE_LOG_WARNING, "%s:%d:%d: %s; it is used as given", r->model->source.files[place.file],
                place.line, place.column, sentence);
    else
        kmp_reader_complain(r, place, "%s", sentence);
}

static bool check_diagonal(kmp_reader *r, const kmp_yaml *node, const kmp_body *body)
{
    bool good = true;
    for (int i = 0; i < 3; i++)
        if (body->inertia[i].value < 0) {
            say_impossible(r, node, kmp_yaml_get(node, inertia_keys[i].name)->place, body,
                           kmp_reader_say(r, "%s = %.6g is negative", inertia_keys[i].name, body->inertia[i].value));
            good = false;
        }
    return good;
}

static void check_tensor(kmp_reader *r, const kmp_yaml *node, const kmp_body *body)
{
    double scale = 0;
    for (int i = 0; i < 3; i++)
        scale = fmax(scale, body->inertia[i].value);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        double two = body->inertia[j].value + body->inertia[k].value;
        if (body->inertia[i].value <= two + slack * scale)
            continue;
        say_impossible(r, node, node->place, body,
                       kmp_reader_say(r, "%s = %.6g is more than %s + %s = %.6g", inertia_keys[i].name,
                                      body->inertia[i].value, inertia_keys[j].name, inertia_keys[k].name, two));
        return;
    }
    if (!is_possible(body->inertia))
        say_impossible(r, node, node->place, body,
                       "its products xy, xz, yz are too large for its moments (no distribution of mass has them)");
}

/* Keeps a number without a unit, whose size is compared when all points are known. */
static void keep_bare(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_body *body, bool moment,
                      double value)
{
    if (value == 0 || !kmp_is_bare(r, node))
        return;
    const kmp_bare_size size = {node->place, kmp_reader_say(r, "%s", what), (int)(body - r->model->bodies), moment,
                                value};
    if (KMP_ARENA_GROW(&r->scratch, r->sizes, r->size_count))
        r->sizes[r->size_count++] = size;
}

static void read_inertia(kmp_reader *r, const kmp_yaml *node, kmp_body *body)
{
    const char *what = kmp_reader_say(r, "the inertia of body '%s'", body->name);
    bool good = true, complete = true;
    if (!kmp_read_map(r, node, what, inertia_keys))
        return;
    (void)is_as_given(r, node);
    for (int i = 0; i < 6; i++) {
        const kmp_yaml *entry = kmp_yaml_get(node, inertia_keys[i].name);
        const char *of = kmp_reader_say(r, "inertia %s of body '%s'", inertia_keys[i].name, body->name);
        if (entry && !kmp_read_number(r, entry, of, kmp_dimension_of(inertia_keys[i].unit), &body->inertia[i]))
            good = false;
        else if (entry && i < 3)
            keep_bare(r, entry, of, body, true, body->inertia[i].value);
        if (!entry && i < 3) {
            complete = false;
            body->left_out[i] = true;
        }
    }
    body->partial = !complete;
    /* plane data has only zz: absent values cannot be checked */
    if (good && check_diagonal(r, node, body) && complete)
        check_tensor(r, node, body);
}

/* The moment of a body about an axis through its centre of mass, in its own axes. */
static double moment_about(const kmp_body *body, const double a[3])
{
    const kmp_number *i = body->inertia;
    return i[0].value * a[0] * a[0] + i[1].value * a[1] * a[1] + i[2].value * a[2] * a[2] +
           2 * (i[3].value * a[0] * a[1] + i[4].value * a[0] * a[2] + i[5].value * a[1] * a[2]);
}

/* The motion that turns a body about an axis for which moments are left out; -1: none is known. The axes of bodies are
 * compared where all coordinates are zero, up to the next joint that turns. */
static int turned_without_moment(const kempe_model *model, int b)
{
    const kmp_body *body = &model->bodies[b];
    for (int p = b, turns = 0; p > 0 && !turns; p = model->bodies[p].parent) {
        const kmp_body *carrier = &model->bodies[p];
        for (int k = carrier->first_motion; k < carrier->first_motion + carrier->motion_count; k++) {
            const double *a = model->motions[k].axis;
            if (!model->motions[k].rotation)
                continue;
            turns++;
            for (int i = 0; i < 3; i++)
                if (body->left_out[i] && a[i] != 0 && moment_about(body, a) == 0)
                    return k;
        }
        if (carrier->turned || carrier->reversed)
            return -1;
    }
    return -1;
}

/* A length this many times as large as the distances of the points of its body is one in mm. A moment in kg mm^2 has a
 * radius of gyration that is a thousand times too large. */
#define MUCH_LARGER 100
/* The least distance that counts as the size of a body, m. */
#define NO_SIZE 1e-6

/* The largest distance of a point of each body from its origin, 0 for none; of all bodies. NULL: no memory. */
static const double *sizes_of_bodies(kmp_reader *r, double *largest)
{
    const kempe_model *model = r->model;
    double *size = KMP_ARENA_NEW(&r->scratch, double, model->body_count);
    *largest = 0;
    for (int k = 0; size && k < model->point_count; k++) {
        const kmp_number *at = model->points[k].at;
        const double far = hypot(hypot(at[0].value, at[1].value), at[2].value);
        if (far > NO_SIZE && model->points[k].body >= 0)
            size[model->points[k].body] = fmax(size[model->points[k].body], far);
        *largest = far > NO_SIZE ? fmax(*largest, far) : *largest;
    }
    return size;
}

/* Gravity of 9810 in a model whose points are metres apart. */
static void warn_of_gravity(kmp_reader *r, double size)
{
    const kmp_yaml *node = kmp_yaml_get(r->root, "gravity");
    for (int k = 0; node && node->kind == KMP_YAML_LIST && size > 0 && size < 10 && k < node->count && k < 3; k++) {
        const double g = r->model->gravity[k].value;
        if (fabs(g) > 9000 && fabs(g) < 10500 && kmp_is_bare(r, node->items[k]))
            kmp_reader_warn(r, node->items[k]->place,
                            "gravity is %g without a unit and is taken in m/s^2, a thousand times the gravity of the "
                            "earth: for mm/s^2 write '%g mm/s^2'",
                            g, g);
    }
}

void kmp_warn_of_sizes(kmp_reader *r)
{
    double largest;
    const double *sizes = sizes_of_bodies(r, &largest);
    if (sizes)
        warn_of_gravity(r, largest);
    for (const kmp_bare_size *x = r->sizes; sizes && x < r->sizes + r->size_count; x++) {
        const double own = sizes[x->body], size = own > 0 ? own : largest, mass = r->model->bodies[x->body].mass.value,
                     length = !x->moment ? fabs(x->value)
                              : mass > 0 ? sqrt(fabs(x->value) / mass)
                                         : 0;
        const char *of = own > 0 ? "its body" : "any body";
        if (size <= 0 || length <= MUCH_LARGER * size)
            continue;
        if (x->moment)
            kmp_reader_warn(
                r, x->place,
                "%s is %g without a unit, taken in kg m^2: a radius of gyration of %.3g m with points of %s "
                "within %.3g m; for mm write '%g kg*mm^2'",
                x->what, x->value, length, of, size, x->value);
        else
            kmp_reader_warn(
                r, x->place,
                "%s is %g without a unit, taken in m, with points of %s within %.3g m; for mm write '%g mm'", x->what,
                x->value, of, size, x->value);
    }
}

void kmp_note_moments(kmp_reader *r)
{
    static const char *const names[3] = {"xx", "yy", "zz"};
    kempe_model *model = r->model;
    for (int b = 1; b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        int k = body->partial && body->mass.value > 0 ? turned_without_moment(model, b) : -1, i = 0;
        while (k >= 0 && i < 2 && !(body->left_out[i] && model->motions[k].axis[i] != 0))
            i++;
        if (k >= 0)
            kmp_reader_warn(r, body->place,
                            "body '%s': coordinate '%s' turns it about an axis without moment of inertia: %s is left "
                            "out and counts as zero; write it, as 0 where that is meant",
                            body->name, model->motions[k].name, names[i]);
    }
}

/* -- by shapes ------------------------------------------------------------------------------------- */

/* A mass that is also given, and a hole in something heavy that is not. */
static bool check_shapes(kmp_reader *r, const kmp_yaml *map, const kmp_body *body, int count, const kmp_shape *shapes)
{
    static const char *const given[] = {"mass", "com", "inertia"};
    bool good = true;
    for (int k = 0; k < 3; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, given[k]);
        good = good && !node;
        if (node)
            kmp_reader_complain(r, node->place,
                                "body '%s': its shape has a density or mass and gives its %s: remove one of the two",
                                body->name, given[k]);
    }
    for (int k = 0; k < count; k++)
        if (shapes[k].hole && !shapes[k].heavy) {
            kmp_reader_complain(r, kmp_yaml_get(map, "shape")->place,
                                "body '%s': a hole needs the density of what it is in, which gives the body's mass",
                                body->name);
            good = false;
        }
    return good;
}

static void take_sum(kmp_reader *r, const kmp_yaml *map, kmp_body *body, const kmp_mass_part *sum)
{
    const kmp_yaml *shape = kmp_yaml_get(map, "shape");
    if (!(sum->mass.value > 0) || !is_possible(sum->inertia)) {
        kmp_reader_complain(r, shape->place,
                            "the shapes of body '%s' have mass %.6g and an inertia that no body has: a hole is larger "
                            "than what it is in",
                            body->name, sum->mass.value);
        return;
    }
    int *symbols = &r->model->symbol_count;
    body->mass = sum->mass;
    body->mass.symbol = ++*symbols;
    for (int k = 0; k < 3; k++) {
        body->com[k] = sum->com[k];
        body->com[k].symbol = ++*symbols;
    }
    for (int k = 0; k < 6; k++) {
        body->inertia[k] = sum->inertia[k];
        body->inertia[k].symbol = ++*symbols;
    }
    body->by_shape = true;
}

void kmp_read_mass(kmp_reader *r, const kmp_yaml *map, int body)
{
    kempe_model *model = r->model;
    kmp_body *own = &model->bodies[body];
    int first = model->shape_count, heavy = 0;
    kmp_mass_part sum = {.mass = {.value = 0}};
    kmp_read_shapes(r, map, &(kmp_shape_owner){body, kmp_reader_say(r, "body '%s'", own->name), NULL});
    for (int k = first; k < model->shape_count; k++)
        heavy += model->shapes[k].heavy;
    if (own->flexible > 0) {
        kmp_check_flexible_mass(r, map, body);
        if (heavy > 0)
            kmp_reader_complain(
                r, kmp_yaml_get(map, "shape")->place,
                "body '%s' is flexible, and its beam gives its mass: a shape of it has neither density nor "
                "mass",
                own->name);
        return;
    }
    if (heavy == 0) {
        const kmp_yaml *mass = kmp_yaml_get(map, "mass"), *com = kmp_yaml_get(map, "com");
        const kmp_yaml *inertia = kmp_yaml_get(map, "inertia");
        const char *what = kmp_reader_say(r, "the mass of body '%s'", own->name);
        if (mass && kmp_read_number(r, mass, what, kmp_key_dimension(kmp_body_keys, "mass"), &own->mass) &&
            own->mass.value < 0)
            kmp_reader_complain(r, mass->place, "%s is negative: %.6g", what, own->mass.value);
        what = kmp_reader_say(r, "the com of body '%s'", own->name);
        if (com && kmp_read_vector(r, com, what, kmp_key_dimension(kmp_body_keys, "com"), own->com))
            for (int k = 0; k < 3 && com->kind == KMP_YAML_LIST; k++)
                keep_bare(r, com->items[k], kmp_reader_say(r, "component %d of %s", k + 1, what), own, false,
                          own->com[k].value);
        if (inertia)
            read_inertia(r, inertia, own);
        return;
    }
    int count = model->shape_count - first;
    const kmp_shape *shapes = &model->shapes[first];
    if (!check_shapes(r, map, own, count, shapes))
        return;
    kmp_shapes_mass(&model->arena, count, shapes, &sum);
    if (!model->arena.failed)
        take_sum(r, map, own, &sum);
}

/* -- motions without mass ---------------------------------------------------------------------------- */

/* Massless motions that the tree shows: the motions of a massless body with massless descendants only, and a last
 * motion that does not move its body's mass. Bodies with closures may be massless: only the reduced mass shows whether
 * their motions move a mass (constraints/partition/singularity_causes.h). */

typedef struct branch {
    bool heavy;    /* the body, or a descendant, has mass or inertia */
    bool closed;   /* so with points of closures */
    bool parent;   /* has a child */
    bool reported; /* an error of a descendant was reported */
} branch;

/* Of a flexible body without deformation, whose joint is at its origin. */
static double carried_by_flexible(const kmp_flexible *flexible, const kmp_motion *last)
{
    double across = 0, a[3];
    if (!last->rotation)
        return flexible->mass->value;
    kmp_flexible_from_body(flexible, last->axis, a);
    for (int k = 0; k < 3; k++) /* tr P - a' P a, where P is diagonal */
        across += flexible->second[k].value * (1 - a[k] * a[k]);
    return across;
}

/* The resistance to the body's last motion: its mass, or its inertia about the axis. */
static double carried(const kempe_model *model, const kmp_body *body, const kmp_motion *last)
{
    if (body->flexible > 0)
        return carried_by_flexible(&model->flexibles[body->flexible - 1], last);
    const double *a = last->axis;
    const kmp_number *c = body->com;
    if (!last->rotation)
        return body->mass.value;
    double along = 0, squared = 0;
    for (int k = 0; k < 3; k++) {
        along += c[k].value * a[k];
        squared += c[k].value * c[k].value;
    }
    return body->mass.value * fmax(squared - along * along, 0) + moment_about(body, a);
}

static bool is_driven(const kempe_model *model, int motion)
{
    for (int c = 0; c < model->closure_count; c++)
        if (model->closures[c].motion == motion)
            return true;
    return false;
}

static void complain_of(const kempe_model *model, const kmp_body *body, const char *what, const char *name,
                        const char *advice)
{
    (void)kmp_complain(model->context, model->source.files[body->place.file], body->place.line, body->place.column,
                       "%s '%s' moves no mass: %s", what, name, advice);
}

/* True if an error was reported here or for a descendant. */
static bool complain(const kempe_model *model, const kmp_body *body, const branch *at)
{
    int last = body->first_motion + body->motion_count - 1;
    bool moves = false;
    for (int k = body->first_motion; k <= last; k++)
        moves = moves || !is_driven(model, k);
    if (at->closed || at->reported || !moves)
        return at->reported;
    if (body->motion_count == 1 && body->armature.value > 0)
        return false;
    if (!at->heavy) {
        complain_of(model, body, "joint", body->joint, "its body has neither mass nor inertia");
        return true;
    }
    if (at->parent || is_driven(model, last) || carried(model, body, &model->motions[last]) > 0)
        return false;
    complain_of(model, body, "coordinate", model->motions[last].name,
                model->motions[last].rotation ? "its body has no inertia about the axis" : "its body has none");
    return true;
}

kempe_status kmp_check_masses(const kempe_model *model)
{
    branch *at = KMP_NEW(branch, model->body_count);
    KMP_TRY(kmp_made(model->context, at));
    for (int c = 0; c < model->closure_count; c++)
        for (int k = 0; k < 2; k++)
            if (model->closures[c].point[k] >= 0)
                at[model->points[model->closures[c].point[k]].body].closed = true;
    for (int b = model->body_count - 1; b > 0; b--) { /* parents precede their children */
        branch *own = &at[b], *parent = &at[model->bodies[b].parent];
        const kmp_body *body = &model->bodies[b];
        own->heavy = own->heavy || body->mass.value != 0 || body->flexible > 0;
        for (int k = 0; k < 6; k++)
            own->heavy = own->heavy || body->inertia[k].value != 0;
        own->reported = complain(model, body, own);
        parent->parent = true;
        parent->heavy = parent->heavy || own->heavy;
        parent->closed = parent->closed || own->closed;
        parent->reported = parent->reported || own->reported;
    }
    bool reported = at[0].reported;
    kmp_free(at);
    return reported ? KEMPE_E_INPUT : KEMPE_OK;
}
