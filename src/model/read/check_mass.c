/* SPDX-License-Identifier: BSD-3-Clause */
/* Massless motions that the tree shows: those of a massless body with massless descendants only, and a last motion that
 * does not move its body's mass. Bodies with closures may be massless: the reduced mass alone shows whether their
 * motions move a mass (constraints/partition/singularity_causes.h). */
#include "model/read/check_mass.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/model.h"
#include <math.h>

typedef struct branch {
    bool heavy;    /* the body, or a descendant, has mass or inertia */
    bool closed;   /* so with points of closures */
    bool parent;   /* has a child */
    bool reported; /* an error of a descendant was reported */
} branch;

static bool is_heavy(const kmp_body *body)
{
    bool heavy = body->mass.value != 0;
    for (int k = 0; k < 6; k++)
        heavy = heavy || body->inertia[k].value != 0;
    return heavy;
}

/* The resistance to the body's last motion: its mass, or its inertia about the axis. */
static double carried(const kmp_body *body, const kmp_motion *last)
{
    const double *a = last->axis;
    const kmp_number *c = body->com, *i = body->inertia;
    if (!last->rotation)
        return body->mass.value;
    double along = 0, squared = 0;
    for (int k = 0; k < 3; k++) {
        along += c[k].value * a[k];
        squared += c[k].value * c[k].value;
    }
    return body->mass.value * fmax(squared - along * along, 0) + i[0].value * a[0] * a[0] + i[1].value * a[1] * a[1] +
           i[2].value * a[2] * a[2] +
           2 * (i[3].value * a[0] * a[1] + i[4].value * a[0] * a[2] + i[5].value * a[1] * a[2]);
}

static bool is_driven(const kempe_model *model, int motion)
{
    for (int c = 0; c < model->closure_count; c++)
        if (model->closures[c].motion == motion)
            return true;
    return false;
}

static bool has_free_motion(const kempe_model *model, const kmp_body *body)
{
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
        if (!is_driven(model, k))
            return true;
    return false;
}

static void complain_of(const kempe_model *model, const kmp_body *body, const char *what, const char *name,
                        const char *advice)
{
    (void)kmp_complain(model->context, model->files[body->place.file], body->place.line, body->place.column,
                       "%s '%s' moves no mass: %s", what, name, advice);
}

/* True if an error was reported here or for a descendant. */
static bool complain(const kempe_model *model, const kmp_body *body, const branch *at)
{
    int last = body->first_motion + body->motion_count - 1;
    if (at->closed || at->reported || !has_free_motion(model, body))
        return at->reported;
    if (body->motion_count == 1 && body->armature.value > 0)
        return false;
    if (!at->heavy) {
        complain_of(model, body, "joint", body->joint, "its body has neither mass nor inertia");
        return true;
    }
    if (at->parent || is_driven(model, last) || carried(body, &model->motions[last]) > 0)
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
        own->heavy = own->heavy || is_heavy(&model->bodies[b]);
        own->reported = complain(model, &model->bodies[b], own);
        parent->parent = true;
        parent->heavy = parent->heavy || own->heavy;
        parent->closed = parent->closed || own->closed;
        parent->reported = parent->reported || own->reported;
    }
    bool reported = at[0].reported;
    kmp_free(at);
    return reported ? KEMPE_E_INPUT : KEMPE_OK;
}
