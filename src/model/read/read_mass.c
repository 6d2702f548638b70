/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, centre of mass and inertia, and the check that a body can have them. */
#include "model/read/read_mass.h"
#include "model/data/model.h"
#include "model/data/shape_mass.h"
#include "model/read/files.h"
#include "model/read/read_bodies.h"
#include "model/read/read_shapes.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

static const kmp_key inertia_keys[] = {
#include "model/keys/inertia_keys.def"
    {0}};

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
    if (word && (word->kind != KMP_YAML_SCALAR || strcmp(word->text, "yes") != 0))
        kmp_reader_complain(r, word->place, "to accept an impossible inertia, write 'as_given: yes'");
    return word;
}

static void say_impossible(kmp_reader *r, const kmp_yaml *node, kmp_place place, const kmp_body *body, const char *why)
{
    const char *sentence = kmp_reader_say(r, "the inertia of body '%s' is impossible: %s", body->name, why);
    if (is_as_given(r, node))
        kmp_log(r->context, KEMPE_LOG_WARNING, "%s:%d:%d: %s; it is used as given", r->model->files[place.file],
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

static void read_inertia(kmp_reader *r, const kmp_yaml *node, kmp_body *body)
{
    const char *what = kmp_reader_say(r, "the inertia of body '%s'", body->name);
    bool good = true, complete = true;
    if (!kmp_read_map(r, node, what, inertia_keys))
        return;
    (void)is_as_given(r, node);
    for (int i = 0; i < 6; i++) {
        const kmp_yaml *entry = kmp_yaml_get(node, inertia_keys[i].name);
        if (entry &&
            !kmp_read_number(r, entry, kmp_reader_say(r, "inertia %s of body '%s'", inertia_keys[i].name, body->name),
                             kmp_dimension_of(inertia_keys[i].unit), &body->inertia[i]))
            good = false;
        if (!entry && i < 3) {
            complete = false;
            body->left_out[i] = true;
        }
    }
    body->partial = !complete;
    /* plane data has zz alone: absent values cannot be checked */
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

static void read_given(kmp_reader *r, const kmp_yaml *map, kmp_body *body)
{
    const kmp_yaml *mass = kmp_yaml_get(map, "mass"), *com = kmp_yaml_get(map, "com");
    const kmp_yaml *inertia = kmp_yaml_get(map, "inertia");
    const char *what = kmp_reader_say(r, "the mass of body '%s'", body->name);
    if (mass && kmp_read_number(r, mass, what, kmp_key_dimension(kmp_body_keys, "mass"), &body->mass) &&
        body->mass.value < 0)
        kmp_reader_complain(r, mass->place, "%s is negative: %.6g", what, body->mass.value);
    if (com)
        kmp_read_vector(r, com, kmp_reader_say(r, "the com of body '%s'", body->name),
                        kmp_key_dimension(kmp_body_keys, "com"), body->com);
    if (inertia)
        read_inertia(r, inertia, body);
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
    if (heavy == 0) {
        read_given(r, map, own);
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
