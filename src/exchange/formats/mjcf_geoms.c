/* SPDX-License-Identifier: BSD-3-Clause */
/* Geoms of MJCF: pictures, and masses. If a mesh gives a body a part of its mass, the masses of all its geoms are
 * added here; otherwise they are those of the shapes in the document. */
#include "exchange/formats/mjcf_geoms.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/foreign_meshes.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf.h"
#include "exchange/formats/mjcf_defaults.h"
#include "model/data/mesh.h"
#include "model/data/shape.h"
#include <math.h>
#include <string.h>

/* -- kinds --------------------------------------------------------------------------------------------- */

static const struct {
    const char *type;
    int solid, sizes; /* -1: no mass, and no picture; -2: mass that is not computed here */
} geoms[] = {{"sphere", KMP_SOLID_SPHERE, 1},
             {"capsule", KMP_SOLID_CAPSULE, 2},
             {"cylinder", KMP_SOLID_CYLINDER, 2},
             {"box", KMP_SOLID_BOX, 3},
             {"ellipsoid", KMP_SOLID_ELLIPSOID, 3},
             {"plane", -1, 0},
             {"hfield", -1, 0},
             {"mesh", -2, 0},
             {"sdf", -2, 0}};

enum { GEOMS = sizeof geoms / sizeof *geoms, GROUPS_DRAWN = 3 /* MuJoCo shows the first ones */ };

void kmp_mjcf_put_between(kmp_mjcf *m, const kmp_mjcf_item *item, int solid, kmp_pose *f, double size[3])
{
    double ends[6], z[3], half = 0;
    if (kmp_mjcf_numbers(m, item, "fromto", 6, 6, ends) == 0)
        return;
    for (int k = 0; k < 3; k++) {
        z[k] = ends[k] - ends[k + 3];
        f->p[k] = (ends[k] + ends[k + 3]) / 2;
        half = hypot(half, z[k] / 2);
    }
    if (!kmp_mjcf_along(z, f->r))
        kmp_import_complain(m->im, item->own->place, "fromto", kmp_mjcf_text(item, "fromto"), "has two equal ends");
    if (solid == KMP_SOLID_BOX || solid == KMP_SOLID_ELLIPSOID) {
        size[1] = size[0];
        size[2] = half;
    } else
        size[1] = half;
}

/* Writes the mass or density of a shape that gives its body a mass. */
static void put_matter(kmp_mjcf *m, const kmp_mjcf_item *item, kmp_yaml *shape)
{
    kmp_place place = item->own->place;
    bool massive = kmp_mjcf_text(item, "mass");
    double matter = kmp_mjcf_number(m, item, massive ? "mass" : "density", 1000);
    if (matter != 0)
        kmp_import_word(m->im, shape, place, massive ? "mass" : "density", kmp_import_number(m->im, matter));
}

static bool has_mass(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    double group = kmp_mjcf_number(m, item, "group", 0);
    double matter = kmp_mjcf_number(m, item, kmp_mjcf_text(item, "mass") ? "mass" : "density", 1000);
    return group >= m->groups[0] && group <= m->groups[1] && matter != 0;
}

/* The element of `asset` with a word and a name, which a mesh may have from its file; NULL: none. */
static const kmp_element *asset_of(kmp_mjcf *m, const char *word, const char *name)
{
    const kmp_element *asset = name ? kmp_element_find(m->im->model, "asset") : NULL;
    for (; asset; asset = kmp_element_again(asset))
        for (const kmp_element *e = kmp_element_find(asset, word); e; e = kmp_element_again(e)) {
            const char *own = kmp_element_text(e, "name"), *file = kmp_element_text(e, "file");
            const char *last = file ? strrchr(file, '/') : NULL;
            size_t length = strlen(name);
            last = last ? last + 1 : file;
            if (own ? strcmp(own, name) == 0 : last && strncmp(last, name, length) == 0 && last[length] == '.')
                return e;
        }
    return NULL;
}

/* The colour of a geom or of its material; NULL: none. */
static const char *colour_of(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    double rgba[4] = {0.5, 0.5, 0.5, 1};
    const kmp_element *e = asset_of(m, "material", kmp_mjcf_text(item, "material"));
    const kmp_mjcf_item material = e ? kmp_mjcf_take(m, e, "material", NULL) : (kmp_mjcf_item){.own = NULL};
    bool given = kmp_mjcf_numbers(m, item, "rgba", 4, 4, rgba) > 0;
    if (!given && e)
        given = kmp_mjcf_numbers(m, &material, "rgba", 4, 4, rgba) > 0;
    return given ? kmp_import_colour(m->im, rgba) : NULL;
}

/* -- meshes -------------------------------------------------------------------------------------------- */

/* A mesh of the assets: its places v are S R' (v - p), of the scale S and of R and p in `reference`. */
typedef struct asset {
    const char *path;
    double scale[3];
    kmp_pose reference;
    const char *inertia;
} asset;

/* False: it has no file. */
static bool find_asset(kmp_mjcf *m, const kmp_mjcf_item *item, asset *a)
{
    const kmp_element *e = asset_of(m, "mesh", kmp_mjcf_text(item, "mesh"));
    const char *file = e ? kmp_element_text(e, "file") : NULL;
    if (!file)
        return false;
    const kmp_mjcf_item mesh = kmp_mjcf_take(m, e, "mesh", NULL);
    double turn[4] = {1, 0, 0, 0};
    *a = (asset){.scale = {1, 1, 1}, .reference = kmp_frame_none(), .inertia = kmp_mjcf_text(&mesh, "inertia")};
    kmp_mjcf_numbers(m, &mesh, "scale", 3, 3, a->scale);
    kmp_mjcf_numbers(m, &mesh, "refpos", 3, 3, a->reference.p);
    if (kmp_mjcf_numbers(m, &mesh, "refquat", 4, 4, turn) > 0 && !kmp_frame_turn(turn, a->reference.r))
        kmp_import_complain(m->im, e->place, "refquat", kmp_mjcf_text(&mesh, "refquat"), "has no length");
    a->path = m->meshes && file[0] != '/' ? kmp_arena_printf(m->im->arena, "%s/%s", m->meshes, file) : file;
    return a->path;
}

/* A mesh whose reference is turned can be drawn if it has one scale. */
static void draw_mesh(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, const asset *a,
                      const kmp_pose *at)
{
    kmp_pose back = kmp_frame_inverse(&a->reference);
    for (int k = 0; k < 3; k++)
        back.p[k] *= a->scale[k];
    const kmp_pose whole = kmp_frame_in(at, &back);
    kmp_import_mesh(m->im, body->map, item->own->place, a->path, a->scale, &whole, colour_of(m, item));
}

/* Reads the mesh at its places; false: `why` has the reason. */
static bool weigh_asset(kmp_mjcf *m, const asset *a, kmp_mesh_volume *volume, kmp_text *why)
{
    static const char *const kinds[] = {
        [KMP_MESH_SOLID] = "exact", [KMP_MESH_SURFACE] = "shell", [KMP_MESH_PYRAMIDS] = "legacy"};
    const kmp_pose back = kmp_frame_inverse(&a->reference);
    kmp_mesh mesh;
    int kind = KMP_MESH_SOLID;
    while (a->inertia && kind <= KMP_MESH_PYRAMIDS && strcmp(kinds[kind], a->inertia) != 0)
        kind++;
    kind = a->inertia ? kind : KMP_MESH_PYRAMIDS;
    if (kind > KMP_MESH_PYRAMIDS)
        kmp_text_printf(why, "its inertia '%s' is not computed; available: exact, legacy, shell", a->inertia);
    if (why->length > 0 || !kmp_import_read_mesh(m->im, a->path, &mesh, why))
        return false;
    for (int v = 0; v < mesh.vertex_count; v++) {
        double place[3];
        kmp_frame_vector(&back, mesh.vertex[v], place);
        for (int k = 0; k < 3; k++)
            mesh.vertex[v][k] = a->scale[k] * (place[k] + back.p[k]);
    }
    return kmp_mesh_weigh(&mesh, (kmp_mesh_matter)kind, volume, why);
}

/* -- masses -------------------------------------------------------------------------------------------- */

/* The geoms that give a body its mass, where one of them is a mesh. */
typedef struct weights {
    kmp_shape *shape; /* NULL: the shapes in the document do */
    int count;
} weights;

static kmp_shape *add_weight(kmp_mjcf *m, const kmp_mjcf_item *item, weights *w, kmp_shape_kind kind,
                             const kmp_pose *at)
{
    kmp_shape *s = &w->shape[w->count++];
    bool massive = kmp_mjcf_text(item, "mass");
    *s = (kmp_shape){.kind = kind, .heavy = true, .by_density = !massive, .turned = kmp_frame_is_turned(at)};
    s->matter.value = kmp_mjcf_number(m, item, massive ? "mass" : "density", 1000);
    s->scale.value = 1;
    memcpy(s->axes, at->r, sizeof s->axes);
    for (int k = 0; k < 3; k++) {
        s->at[k].value = at->p[k];
        s->along[k].value = at->r[k][2];
    }
    return s;
}

static void weigh_solid(kmp_mjcf *m, const kmp_mjcf_item *item, weights *w, int solid, const kmp_pose *at,
                        const double size[3])
{
    static const kmp_shape_kind kinds[] = {[KMP_SOLID_BOX] = KMP_SHAPE_BOX,
                                           [KMP_SOLID_SPHERE] = KMP_SHAPE_SPHERE,
                                           [KMP_SOLID_CYLINDER] = KMP_SHAPE_CYLINDER,
                                           [KMP_SOLID_CAPSULE] = KMP_SHAPE_CAPSULE,
                                           [KMP_SOLID_ELLIPSOID] = KMP_SHAPE_ELLIPSOID};
    kmp_shape *s = add_weight(m, item, w, kinds[solid], at);
    for (int k = 0; k < 3; k++)
        s->edge[k].value = size[k];
    s->radius.value = size[0];
    s->length.value = size[1];
}

static void weigh_mesh(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, weights *w, const asset *a,
                       const kmp_pose *at)
{
    kmp_mesh_volume volume;
    kmp_text why = {0};
    if (!a)
        kmp_text_put(&why, "it has no file");
    if (a && weigh_asset(m, a, &volume, &why))
        add_weight(m, item, w, KMP_SHAPE_MESH, at)->enclosed = volume;
    else if (why.length > 0)
        kmp_import_complain(
            m->im, item->own->place, "the body", body->own,
            kmp_arena_printf(m->im->arena, "has its mass from a mesh, and %s: give it an element 'inertial'", why.s));
    m->im->arena->failed = m->im->arena->failed || why.failed;
    kmp_text_free(&why);
}

static void put_weights(kmp_mjcf *m, const kmp_mjcf_body *body, const weights *w, kmp_place place)
{
    kmp_mass_part sum;
    kmp_pose centre = kmp_frame_none();
    if (w->count == 0)
        return;
    kmp_shapes_mass(m->im->arena, w->count, w->shape, &sum);
    const kmp_number *i = sum.inertia;
    const double tensor[3][3] = {{i[0].value, i[3].value, i[4].value},
                                 {i[3].value, i[1].value, i[5].value},
                                 {i[4].value, i[5].value, i[2].value}};
    for (int k = 0; k < 3; k++)
        centre.p[k] = sum.com[k].value;
    kmp_import_mass(m->im, body->map, place, sum.mass.value, &centre, tensor);
}

/* -- geoms --------------------------------------------------------------------------------------------- */

static bool is_mesh(const kmp_mjcf_item *item)
{
    const char *type = kmp_mjcf_text(item, "type");
    return type && strcmp(type, "mesh") == 0;
}

/* The row of `geoms`; GEOMS after a complaint. */
static int kind_of(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    const char *type = kmp_mjcf_text(item, "type");
    int k = 0;
    while (type && k < GEOMS && strcmp(geoms[k].type, type) != 0)
        k++;
    if (k == GEOMS)
        kmp_import_complain(
            m->im, item->own->place, "geom type", type,
            "is unknown; available: plane, hfield, sphere, capsule, ellipsoid, cylinder, box, mesh, sdf");
    return k;
}

/* True if the geom gives its body a mass; what cannot is named. */
static bool gives_mass(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, int kind)
{
    kmp_import *im = m->im;
    if (geoms[kind].solid == -1 || !has_mass(m, item))
        return false;
    bool shell = kmp_mjcf_flag(m, item, "shellinertia", false), mesh = is_mesh(item);
    bool fitted = !mesh && (geoms[kind].solid == -2 || kmp_mjcf_text(item, "mesh"));
    const char *what = shell ? "shell" : "mesh";
    if (body->fixed && (shell || mesh || fitted))
        kmp_import_leave_out(im, item->own->place, KMP_PART_REMARK, "geom",
                             "the mass of a %s of body '%s' is not used: the body is fixed", what, body->own);
    else if (shell || fitted)
        kmp_import_complain(im, item->own->place, "the body", body->own,
                            kmp_arena_printf(im->arena, "has its mass from a %s: give it an element 'inertial'",
                                             shell ? what : "solid that is fitted to a mesh"));
    else
        return true;
    return false;
}

static void add_solid(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_part *p, const kmp_mjcf_item *item, int k,
                      bool heavy, weights *w)
{
    kmp_import *im = m->im;
    double size[3] = {0};
    kmp_pose f = kmp_mjcf_pose(m, item);
    int sizes = kmp_mjcf_numbers(m, item, "size", 1, 3, size);
    if (kmp_mjcf_text(item, "fromto"))
        kmp_mjcf_put_between(m, item, geoms[k].solid, &f, size);
    else if (sizes < geoms[k].sizes)
        kmp_import_complain(im, p->element->place, "geom type", geoms[k].type, "needs more numbers in its size");
    f = kmp_frame_in(&p->frame, &f);
    bool three = geoms[k].sizes == 3;
    for (int i = 0; i < 3; i++)
        size[i] *= geoms[k].solid == KMP_SOLID_BOX || (!three && i == 1) ? 2 : 1;
    kmp_yaml *shape = kmp_import_shape(im, body->map, p->element->place, (kmp_import_solid)geoms[k].solid, size, &f,
                                       colour_of(m, item));
    if (heavy && w->shape)
        weigh_solid(m, item, w, geoms[k].solid, &f, size);
    else if (heavy)
        put_matter(m, item, shape);
}

static void add_geom(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const kmp_mjcf_part *p, weights *w)
{
    const kmp_mjcf_item item = kmp_mjcf_take(m, p->element, "geom", p->around);
    int k = kind_of(m, &item);
    if (k == GEOMS)
        return;
    heavy = heavy && gives_mass(m, body, &item, k);
    bool drawn = kmp_mjcf_number(m, &item, "group", 0) < GROUPS_DRAWN;
    if (is_mesh(&item)) {
        asset a;
        const kmp_pose own = kmp_mjcf_pose(m, &item), f = kmp_frame_in(&p->frame, &own);
        bool known = find_asset(m, &item, &a);
        if (drawn && known)
            draw_mesh(m, body, &item, &a, &f);
        if (heavy)
            weigh_mesh(m, body, &item, w, known ? &a : NULL, &f);
    } else if (geoms[k].solid >= 0 && !kmp_mjcf_text(&item, "mesh") && (drawn || heavy))
        add_solid(m, body, p, &item, k, heavy, w);
}

void kmp_mjcf_add_geoms(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const kmp_mjcf_part *list)
{
    weights w = {.count = 0};
    int count = 0;
    bool meshes = false;
    for (const kmp_mjcf_part *p = list; p; p = p->next, count++) {
        const kmp_mjcf_item item = kmp_mjcf_take(m, p->element, "geom", p->around);
        meshes = meshes || (heavy && !body->fixed && is_mesh(&item) && has_mass(m, &item));
    }
    if (meshes)
        w.shape = KMP_ARENA_NEW(m->im->arena, kmp_shape, count);
    if (m->im->arena->failed)
        return;
    for (const kmp_mjcf_part *p = list; p; p = p->next)
        add_geom(m, body, heavy, p, &w);
    if (meshes)
        put_weights(m, body, &w, list->element->place);
}
