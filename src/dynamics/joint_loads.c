/* SPDX-License-Identifier: BSD-3-Clause */
/* Joint loads by virtual work: the joint is displaced and turned by six inputs in a copy of the tree. Derivatives of
 * lengths and angles along these inputs give the generalized forces, which are force and moment. Parts along the free
 * motions are removed at the end. */
#include "dynamics/joint_loads.h"
#include "base/context.h"
#include "constraints/kinds/kind.h"
#include "dynamics/connected_bodies.h"
#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "symbolic/derivative.h"
#include "symbolic/substitute.h"
#include <string.h>

enum { VIRTUAL = 6 }; /* three translations and three rotations, in the axes of the parent's link */

/* The axes of a link in the axes of the ground. */
typedef struct link_axes {
    kmp_vec e[3];
} link_axes;

/* Numbers of closures or of forces, in the order of the model. */
typedef struct crossing {
    int *of, *from;                /* of each body: between the two sides of its joint */
    int *anywhere, anywhere_count; /* of coordinates and expressions, or without two points */
} crossing;

struct kmp_joint_loads {
    kmp_forces forces;
    kmp_ref *qdd;
    kmp_link_motion *motion; /* of each link */
    kmp_wrench *inertial;    /* a link: of all that it carries, about its origin, its axes */
    kmp_wrench *of;          /* a body: the load of its joint */
    bool *known;
    link_axes *axes;               /* of each link; NULL: found for each vector */
    kmp_link *spare;               /* a copy of the tree's links; NULL: none, or in use */
    crossing closures;             /* without pairs of gear wheels */
    crossing elements;             /* friction along lengths and angles, and rigid contacts */
    int *gear, gear_count;         /* pairs of gear wheels */
    int *element, element_count;   /* all elements */
    crossing presses;              /* compliant contacts and films */
    int *pressing, pressing_count; /* all of them */
    kmp_ref *against;              /* KMP_COMPLIANT_FORCES of each force of the model */
    kmp_time_seeds seeds;          /* with the virtual displacements as coordinates */
    kmp_vec spin;                  /* their rotation */
};

/* -- virtual motions --------------------------------------------------------------------------------- */

/* A copy of the tree whose links can be displaced. Conditions are evaluated in place. False: no memory. */
static bool copy_links(const kmp_tree *tree, kmp_tree *moved)
{
    *moved = *tree;
    moved->links = tree->reactions.joints->spare;
    tree->reactions.joints->spare = NULL;
    moved->names.value = NULL;
    moved->conditions.events = NULL;
    moved->conditions.noted = NULL;
    moved->seeds = &tree->reactions.joints->seeds;
    if (moved->links)
        return true;
    moved->links = KMP_GRAPH_NEW(tree->graph, kmp_link, tree->count);
    if (moved->links)
        memcpy(moved->links, tree->links, (size_t)tree->count * sizeof *moved->links);
    return moved->links;
}

/* Keeps the copy for the next joint, with this link as it was. */
static void put_back(const kmp_tree *tree, int link, kmp_tree *moved)
{
    moved->links[link] = tree->links[link];
    tree->reactions.joints->spare = moved->links;
}

/* Displaces and turns link `first` of the copy before its motion by the inputs KMP_IN_ALONG: about its own place, or
 * about its parent's origin. */
static void displace(const kmp_tree *tree, int first, bool about_parent, kmp_tree *moved)
{
    kmp_graph *g = tree->graph;
    kmp_link *link = &moved->links[first];
    kmp_vec shift, turn;
    for (uint32_t k = 0; k < 3; k++) {
        shift.x[k] = kmp_input(g, KMP_IN_ALONG, k);
        turn.x[k] = kmp_input(g, KMP_IN_ALONG, 3 + k);
    }
    if (about_parent)
        shift = kmp_vec_add(g, shift, kmp_vec_cross(g, turn, link->p));
    link->p = kmp_vec_add(g, link->p, shift);
    for (int column = 0; column < 3; column++) { /* (1 + turn x) g */
        kmp_vec e;
        for (int row = 0; row < 3; row++)
            e.x[row] = kmp_link_axes(tree, first, row, column);
        e = kmp_vec_add(g, e, kmp_vec_cross(g, turn, e));
        for (int row = 0; row < 3; row++)
            link->chart[row][column] = e.x[row];
    }
    link->before = link->before < 0 ? 0 : link->before;
    link->turned = true;
    link->virtual_spin = &tree->reactions.joints->spin;
}

/* -- what acts across a joint or a section ------------------------------------------------------------------------ */

/* Quantities of virtual motions, and the generalized force along each. */
typedef struct acting {
    int count;
    kmp_ref *of, *force;
} acting;

static void add_acting(acting *a, kmp_ref of, kmp_ref force)
{
    a->of[a->count] = of;
    a->force[a->count] = force;
    a->count += of != KMP_ZERO && force != KMP_ZERO;
}

/* The next body on the way from two bodies to the one that carries both; -1: there is none. */
static int next_between(const kempe_model *model, int side[2])
{
    int *deeper = &side[side[1] > side[0]];
    const int body = *deeper;
    if (side[0] == side[1])
        return -1;
    *deeper = model->bodies[body].parent;
    return body;
}

/* True for friction along a length or an angle, and for rigid contacts. */
static bool is_element(const kmp_force *force)
{
    return force->kind == KMP_FORCE_TOUCH || (force->kind == KMP_FORCE_FRICTION && kmp_friction_is_along(force));
}

static void list_elements(kmp_joint_loads *loads, const kmp_tree *tree)
{
    const kempe_model *model = tree->model;
    loads->element = KMP_GRAPH_NEW(tree->graph, int, model->force_count + 1);
    loads->pressing = KMP_GRAPH_NEW(tree->graph, int, model->force_count + 1);
    for (int k = 0; loads->element && loads->pressing && k < model->force_count; k++) {
        const kmp_force *force = &model->forces[k];
        if (force->kind == KMP_FORCE_COMPLIANT)
            loads->pressing[loads->pressing_count++] = k;
        if (is_element(force))
            loads->element[loads->element_count++] = k;
    }
}

static void list_gears(kmp_joint_loads *loads, const kmp_tree *tree)
{
    loads->gear = KMP_GRAPH_NEW(tree->graph, int, tree->model->closure_count + 1);
    for (int c = 0; loads->gear && c < tree->model->closure_count; c++)
        if (tree->model->closures[c].gear && !kmp_closure_is_of_modes(&tree->model->closures[c]))
            loads->gear[loads->gear_count++] = c;
}

/* The bodies between which a closure or a force acts; none: it does not belong to the list. */
typedef void place_fn(int number, kmp_connected_bodies *bodies);

static void closure_place(int c, kmp_connected_bodies *bodies)
{
    const kmp_closure *closure = &bodies->model->closures[c];
    if (kmp_closure_is_of_modes(closure) || closure->gear)
        return;
    bodies->any = closure->point[0] < 0 || closure->point[1] < 0 ||
                  kmp_closure_parts_of(closure->kind)->force->load == kmp_part_effort;
    kmp_connected_by_point(bodies, closure->point[0]);
    kmp_connected_by_point(bodies, closure->point[1]);
}

static void element_place(int f, kmp_connected_bodies *bodies)
{
    const kmp_force *force = &bodies->model->forces[f];
    if (!is_element(force))
        return;
    const kmp_force *contact =
        force->kind == KMP_FORCE_FRICTION && force->contact > 0 ? &bodies->model->forces[force->contact - 1] : force;
    if (contact->kind == KMP_FORCE_TOUCH)
        kmp_connected_by_contact(bodies, contact);
    else
        bodies->any = true;
}

static void pressing_place(int f, kmp_connected_bodies *bodies)
{
    if (bodies->model->forces[f].kind == KMP_FORCE_COMPLIANT)
        kmp_connected_by_contact(bodies, &bodies->model->forces[f]);
}

/* Lists what a joint changes, of `count`: first the number of each joint is counted. */
static void list_crossing(crossing *all, const kmp_tree *tree, int count, place_fn *place)
{
    const kempe_model *model = tree->model;
    int *from = all->from = KMP_GRAPH_NEW(tree->graph, int, model->body_count + 2), body;
    int *last = KMP_GRAPH_NEW(tree->graph, int, model->body_count); /* 1 + the last of each body */
    all->anywhere = KMP_GRAPH_NEW(tree->graph, int, count + 1);
    for (int pass = 0; from && last && all->anywhere && pass < 2; pass++) {
        memset(last, 0, (size_t)model->body_count * sizeof *last);
        for (int i = 0; i < count; i++) {
            kmp_connected_bodies at = {.model = model};
            place(i, &at);
            if (at.any && pass == 0)
                all->anywhere[all->anywhere_count++] = i;
            for (int k = 1; !at.any && k < at.count; k++) {
                int side[2] = {at.body[0], at.body[k]};
                while ((body = next_between(model, side)) >= 0) {
                    if (last[body] == 1 + i)
                        continue;
                    last[body] = 1 + i;
                    if (pass == 1)
                        all->of[from[body + 1]] = i;
                    from[body + (pass == 0 ? 2 : 1)]++;
                }
            }
        }
        for (int b = 0; pass == 0 && b < model->body_count; b++)
            from[b + 2] += from[b + 1];
        if (pass == 0 && !(all->of = KMP_GRAPH_NEW(tree->graph, int, from[model->body_count + 1] + 1)))
            return;
    }
}

/* Numbers of the closures or forces that act across a joint, or a section. */
typedef struct across_list {
    int count;
    const int *of;
} across_list;

/* Merges what is between the two sides of a body's joint with what may be anywhere. */
static across_list list_across(const crossing *all, kmp_graph *g, int body)
{
    const int *own = all->of + all->from[body], *end = all->of + all->from[body + 1], *any = all->anywhere,
              *last = any + all->anywhere_count;
    int *of = KMP_GRAPH_NEW(g, int, (end - own) + (last - any) + 1), count = 0;
    while (of && (own < end || any < last))
        of[count++] = own < end && (any == last || *own < *any) ? *own++ : *any++;
    return (across_list){count, of};
}

/* Elements; across: a body; negative: a section. */
static across_list elements_across(const kmp_joint_loads *loads, kmp_graph *g, int across)
{
    return across < 0 ? (across_list){loads->element_count, loads->element} : list_across(&loads->elements, g, across);
}

/* Compliant contacts and films, likewise. */
static across_list pressing_across(const kmp_joint_loads *loads, kmp_graph *g, int across)
{
    return across < 0 ? (across_list){loads->pressing_count, loads->pressing} : list_across(&loads->presses, g, across);
}

static void add_closure_rows(const kmp_tree *moved, int c, acting *a)
{
    const kmp_closure *closure = &moved->model->closures[c];
    const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
    kmp_ref h[KMP_KIND_MAX_ROWS] = {KMP_ZERO};
    kmp_closure_residual(kind, moved, closure, h);
    for (int k = 0; k < kmp_closure_rows(kind, closure); k++)
        add_acting(a, h[k], kmp_tree_multiplier(moved, c, k));
}

/* across: a body; negative: a section. */
static void add_rows(const kmp_joint_loads *loads, const kmp_tree *moved, int across, acting *a)
{
    const kempe_model *model = moved->model;
    for (int c = 0; across < 0 && c < model->closure_count; c++)
        if (!kmp_closure_is_of_modes(&model->closures[c]) && !model->closures[c].gear)
            add_closure_rows(moved, c, a);
    if (across < 0)
        return;
    const across_list own = list_across(&loads->closures, moved->graph, across);
    for (int i = 0; i < own.count; i++)
        add_closure_rows(moved, own.of[i], a);
}

enum { BOTH = 2 * VIRTUAL }; /* displacements, then their rates */

/* Adds the generalized forces along the last VIRTUAL of `count` displacements, at zero of all. */
static void add_virtual(kmp_graph *g, const acting *a, int count, kmp_ref *slope, kmp_ref generalized[VIRTUAL])
{
    kmp_ref from[BOTH], to[BOTH] = {KMP_ZERO};
    uint16_t through;
    kmp_partials_all(g, a->count, a->of, KMP_IN_ALONG, count, slope);
    for (int k = 0; k < count; k++)
        from[k] = kmp_input(g, KMP_IN_ALONG, (uint32_t)k);
    if (a->count > 0 && !kmp_substitute(g, count, from, to, count * a->count, slope, &through))
        kmp_graph_fail(g);
    for (int i = 0; i < a->count; i++)
        for (int k = 0; k < VIRTUAL; k++)
            generalized[k] = kmp_add(g, generalized[k], kmp_mul(g, a->force[i], slope[count * (i + 1) - VIRTUAL + k]));
}

/* Forces along rates by virtual power. */
static void add_rates(const kmp_joint_loads *loads, const kmp_tree *moved, int across, kmp_ref generalized[VIRTUAL])
{
    kmp_graph *g = moved->graph;
    const across_list elements = elements_across(loads, g, across), pressing = pressing_across(loads, g, across);
    const int room = KMP_COMPLIANT_FORCES * pressing.count + elements.count;
    kmp_ref *slope = KMP_GRAPH_NEW(g, kmp_ref, BOTH * room + 1);
    acting a = {0, KMP_GRAPH_NEW(g, kmp_ref, room + 1), KMP_GRAPH_NEW(g, kmp_ref, room + 1)};
    if (!slope || !a.of || !a.force)
        return;
    /* Forces along rates: compliant contacts and films, and friction that rolls along no length. */
    const kempe_model *model = moved->model;
    for (int i = 0; i < pressing.count; i++) {
        const int f = pressing.of[i];
        kmp_ref against[KMP_COMPLIANT_FORCES], unused[KMP_COMPLIANT_FORCES];
        const int count = kmp_compliant_forces(moved, &model->forces[f], against, unused);
        for (int c = 0; c < count; c++)
            add_acting(&a, against[c], kmp_neg(loads->against[KMP_COMPLIANT_FORCES * f + c]));
    }
    for (int i = 0; i < elements.count; i++) {
        const kmp_force *force = &model->forces[elements.of[i]];
        kmp_ref of;
        if (force->kind == KMP_FORCE_FRICTION && kmp_friction_slopes_of(moved, force, &of) == KMP_IN_QD)
            add_acting(&a, of, loads->forces.value[KMP_FORCE_WIDTH * elements.of[i]]);
    }
    add_virtual(g, &a, BOTH, slope, generalized);
}

/* True if the copy of the tree displaces a body. */
static bool is_displaced(const kmp_tree *tree, const kmp_tree *moved, int body)
{
    bool displaced = false;
    for (int i = tree->mounts[body].link; i > 0; i = tree->links[i].parent)
        displaced = displaced || memcmp(&moved->links[i], &tree->links[i], sizeof *tree->links) != 0;
    return displaced;
}

/* Adds the forces of teeth on displaced wheels: as force and moment about a point of a link. */
static void add_teeth(const kmp_joint_loads *loads, const kmp_tree *tree, const kmp_tree *moved, int link,
                      kmp_vec about, kmp_ref generalized[VIRTUAL])
{
    kmp_graph *g = tree->graph;
    for (int i = 0; i < loads->gear_count; i++) {
        const kmp_closure *closure = &tree->model->closures[loads->gear[i]];
        const bool first = is_displaced(tree, moved, closure->gear->wheel[0]);
        kmp_vec force, place;
        if (first == is_displaced(tree, moved, closure->gear->wheel[1]))
            continue;
        const kmp_ref lambda = kmp_gear_transmitted(tree, loads->gear[i]);
        const int carrier = tree->mounts[closure->gear->carrier].link, top = kmp_tree_common(tree, carrier, link);
        kmp_gear_force(tree, closure, lambda, top, &force, &place);
        place = kmp_vec_sub(g, place, kmp_link_position(tree, link, about, top));
        force = kmp_from_ancestor(tree, link, top, first ? kmp_vec_sub(g, kmp_vec_zero(), force) : force);
        place = kmp_from_ancestor(tree, link, top, place);
        const kmp_vec moment = kmp_vec_cross(g, place, force);
        for (int k = 0; k < 3; k++) {
            generalized[k] = kmp_add(g, generalized[k], force.x[k]);
            generalized[3 + k] = kmp_add(g, generalized[3 + k], moment.x[k]);
        }
    }
}

/* Friction along a length or an angle, and rigid contacts: their forces are in the values of all modes. */
static void add_element(const kmp_joint_loads *loads, const kmp_tree *moved, int f, acting *a)
{
    const kmp_force *force = &moved->model->forces[f];
    kmp_ref of = KMP_ZERO;
    if (force->kind == KMP_FORCE_TOUCH)
        of = kmp_touching_gap(moved, &force->touch);
    else if (kmp_friction_slopes_of(moved, force, &of) == KMP_IN_QD) /* a rate (add_rates) */
        of = KMP_ZERO;
    add_acting(a, of, loads->forces.value[KMP_FORCE_WIDTH * f]);
}

/* The generalized forces of closures and elements along the virtual motions of a copy of the tree, across a body's
 * joint or, where negative, a section. */
static void find_acting(kmp_joint_loads *loads, const kmp_tree *tree, const kmp_tree *moved, int across,
                        kmp_ref generalized[VIRTUAL])
{
    kmp_graph *g = tree->graph;
    const crossing *all = &loads->closures;
    const int closures =
        across < 0 ? tree->model->closure_count : all->from[across + 1] - all->from[across] + all->anywhere_count;
    const across_list elements = elements_across(loads, g, across);
    const int room = KMP_KIND_MAX_ROWS * closures + elements.count;
    kmp_ref *slope = KMP_GRAPH_NEW(g, kmp_ref, VIRTUAL * room + 1);
    acting a = {0, KMP_GRAPH_NEW(g, kmp_ref, room + 1), KMP_GRAPH_NEW(g, kmp_ref, room + 1)};
    if (!slope || !a.of || !a.force)
        return;
    add_rows(loads, moved, across, &a);
    for (int i = 0; i < elements.count; i++)
        add_element(loads, moved, elements.of[i], &a);
    for (int k = 0; k < VIRTUAL; k++)
        generalized[k] = KMP_ZERO;
    add_virtual(g, &a, VIRTUAL, slope, generalized);
}

/* -- the load of the constraint ---------------------------------------------------------------------- */

/* The part of v across `count` directions. */
static kmp_vec across(kmp_graph *g, int count, const kmp_vec *along, kmp_vec v)
{
    if (count == 0)
        return v;
    if (count > 2)
        return kmp_vec_zero();
    kmp_vec n = count > 1 ? kmp_vec_cross(g, along[0], along[1]) : along[0];
    kmp_vec part = kmp_vec_scale(g, kmp_div(g, kmp_vec_dot(g, v, n), kmp_vec_dot(g, n, n)), n);
    return count > 1 ? part : kmp_vec_sub(g, v, part);
}

/* Removes the parts along the free motions from a wrench about the chain's beginning. Forces of motions act at the
 * point through which the axes of all rotations pass: the chain's beginning where rotations come first, otherwise its
 * end. */
static void constrain(const kmp_tree *tree, const kmp_body *body, kmp_wrench *w)
{
    kmp_graph *g = tree->graph;
    const kempe_model *model = tree->model;
    const int begin = tree->of_motion[body->first_motion], parent = tree->links[begin].parent;
    int first = kmp_joint_first_free(body), last = body->first_motion + body->motion_count, count[2] = {0, 0};
    kmp_vec along[2][3];
    for (int k = first; k < last; k++) {
        bool rotation = model->motions[k].rotation;
        const int link = tree->of_motion[k];
        kmp_vec e = kmp_vec_axis(KMP_ONE, tree->links[link].axis);
        if (count[rotation] < 3)
            along[rotation][count[rotation]++] = kmp_link_direction(tree, link, e, parent);
    }
    kmp_vec end = kmp_link_position(tree, tree->of_motion[last - 1], kmp_vec_zero(), parent);
    kmp_vec arm = kmp_vec_sub(g, end, tree->links[begin].p);
    bool at_end = !model->motions[first].rotation;
    kmp_vec lever = kmp_vec_cross(g, arm, w->force), moment = w->moment;
    moment = across(g, count[1], along[1], at_end ? kmp_vec_sub(g, moment, lever) : moment);
    w->force = across(g, count[0], along[0], w->force);
    lever = kmp_vec_cross(g, arm, w->force);
    if (at_end && body->loads_parent)
        moment = kmp_vec_add(g, moment, lever);
    if (!at_end && !body->loads_parent)
        moment = kmp_vec_sub(g, moment, lever);
    w->moment = moment;
}

/* A vector of a link in the axes of the ground. */
static kmp_vec in_ground(const kmp_tree *tree, int link, kmp_vec v)
{
    kmp_graph *g = tree->graph;
    if (!tree->reactions.joints->axes || (tree->heading && tree->heading[link] != KMP_ZERO))
        return kmp_link_direction(tree, link, v, 0);
    kmp_vec sum = kmp_vec_zero();
    for (int k = 0; k < 3; k++)
        sum = kmp_vec_add(g, sum, kmp_vec_scale(g, v.x[k], tree->reactions.joints->axes[link].e[k]));
    return sum;
}

/* The axes of all links, so that the loads of N joints in a row need no N^2 rotations. Links that turn about parallel
 * axes have an angle in its place. */
static void find_axes(kmp_joint_loads *loads, const kmp_tree *tree)
{
    loads->axes = KMP_GRAPH_NEW(tree->graph, link_axes, tree->count);
    for (int i = 0; loads->axes && i < tree->count; i++)
        for (int k = 0; k < 3; k++) {
            const kmp_vec e = kmp_vec_axis(KMP_ONE, k);
            loads->axes[i].e[k] = i == 0 ? e : in_ground(tree, tree->links[i].parent, kmp_link_to_parent(tree, i, e));
        }
}

static void find_load(kmp_joint_loads *loads, const kmp_tree *tree, int body)
{
    kmp_graph *g = tree->graph;
    const kmp_body *b = &tree->model->bodies[body];
    int first = tree->of_motion[b->first_motion];
    kmp_wrench w = loads->inertial[first];
    kmp_ref generalized[VIRTUAL] = {KMP_ZERO};
    kmp_tree moved;
    if (!copy_links(tree, &moved))
        return;
    displace(tree, first, false, &moved);
    find_acting(loads, tree, &moved, body, generalized);
    add_rates(loads, &moved, body, generalized);
    add_teeth(loads, tree, &moved, tree->links[first].parent, tree->links[first].p, generalized);
    put_back(tree, first, &moved);
    w.moment = kmp_vec_add(g, w.moment, kmp_vec_cross(g, kmp_link_slide(tree, first), w.force));
    w.force = kmp_link_to_parent(tree, first, w.force);
    w.moment = kmp_link_to_parent(tree, first, w.moment);
    for (int k = 0; k < 3; k++) {
        w.force.x[k] = kmp_sub(g, w.force.x[k], generalized[k]);
        w.moment.x[k] = kmp_sub(g, w.moment.x[k], generalized[3 + k]);
    }
    constrain(tree, b, &w);
    if (b->loads_parent) {
        w.force = kmp_vec_sub(g, kmp_vec_zero(), w.force);
        w.moment = kmp_vec_sub(g, kmp_vec_zero(), w.moment);
    }
    loads->of[body].force = in_ground(tree, tree->links[first].parent, w.force);
    loads->of[body].moment = in_ground(tree, tree->links[first].parent, w.moment);
    loads->known[body] = true;
}

kmp_vec kmp_joint_load(const kmp_tree *tree, int body, bool moment)
{
    kmp_joint_loads *loads = tree->reactions.joints;
    if (!loads->known[body])
        find_load(loads, tree, body);
    return moment ? loads->of[body].moment : loads->of[body].force;
}

/* -- sections of beams ------------------------------------------------------------------------------- */

/* True if link i, which the frame of a flexible body carries, is beyond its station s. */
static bool is_beyond(const kmp_tree *tree, int which, int frame, int s, int i)
{
    const double rounding = 1e-12;
    const kmp_flexible *flexible = &tree->model->flexibles[which];
    const double from = flexible->stations[s].at[0].value - rounding * flexible->length->value;
    bool beyond = s == 0;
    for (int k = 0; k < flexible->station_count && !beyond; k++) {
        int link = tree->stations[which][k]; /* the link that carries the station, nearest to the frame */
        if (flexible->stations[k].at[0].value < from)
            continue;
        while (tree->links[link].parent != frame)
            link = tree->links[link].parent;
        beyond = link == i;
    }
    return beyond;
}

static int station_of(const kempe_model *model, int point)
{
    return model->points[point].station > 0 ? model->points[point].station - 1 : 0;
}

/* About the origin of the frame and in its axes. */
static kmp_wrench beyond_section(const kmp_tree *tree, int point)
{
    kmp_joint_loads *loads = tree->reactions.joints;
    kmp_graph *g = tree->graph;
    const int body = tree->model->points[point].body, which = tree->model->bodies[body].flexible - 1;
    const int frame = tree->mounts[body].link, s = station_of(tree->model, point);
    const kmp_flexible *part = tree->model->flexibles[which].stations[s].beyond;
    const kmp_deformation *own = s == 0 ? tree->links[frame].deformation : kmp_deformation_new(tree, part, frame);
    kmp_ref generalized[VIRTUAL] = {KMP_ZERO};
    kmp_wrench w = {kmp_vec_zero(), kmp_vec_zero()};
    kmp_tree moved;
    if (!own || !copy_links(tree, &moved))
        return w;
    w = kmp_newton_euler_part(tree, own, loads->qdd, &loads->motion[frame]);
    for (int i = frame + 1; i < tree->count; i++)
        if (tree->links[i].parent == frame && is_beyond(tree, which, frame, s, i)) {
            kmp_wrench_to_parent(tree, i, loads->inertial[i], &w);
            displace(tree, i, true, &moved);
        }
    find_acting(loads, tree, &moved, -1 - point, generalized);
    add_rates(loads, &moved, -1 - point, generalized);
    add_teeth(loads, tree, &moved, frame, kmp_vec_zero(), generalized);
    for (int i = frame + 1; i < tree->count; i++)
        put_back(tree, i, &moved);
    for (int k = 0; k < 3; k++) {
        w.force.x[k] = kmp_sub(g, generalized[k], w.force.x[k]);
        w.moment.x[k] = kmp_sub(g, generalized[3 + k], w.moment.x[k]);
    }
    return w;
}

kmp_wrench kmp_section_load(const kmp_tree *tree, int point)
{
    kmp_graph *g = tree->graph;
    const int body = tree->model->points[point].body, which = tree->model->bodies[body].flexible - 1;
    const int frame = tree->mounts[body].link, section = tree->stations[which][station_of(tree->model, point)];
    kmp_wrench w = beyond_section(tree, point);
    const kmp_vec place = kmp_link_position(tree, section, kmp_vec_zero(), frame);
    w.moment = kmp_vec_sub(g, w.moment, kmp_vec_cross(g, place, w.force));
    w.force = kmp_from_ancestor(tree, section, frame, w.force);
    w.moment = kmp_from_ancestor(tree, section, frame, w.moment);
    return w;
}

kmp_ref kmp_section_stress(const kmp_tree *tree, int point)
{
    kmp_graph *g = tree->graph;
    const kmp_point *p = &tree->model->points[point];
    const kmp_flexible *flexible = &tree->model->flexibles[tree->model->bodies[p->body].flexible - 1];
    const kmp_vec section = kmp_tree_vector(tree, flexible->stations[station_of(tree->model, point)].section);
    const kmp_vec offset = kmp_body_vector(tree, p->body, kmp_tree_vector(tree, p->station > 0 ? p->offset : p->at));
    const kmp_wrench load = kmp_section_load(tree, point);
    kmp_ref sum = kmp_div(g, load.force.x[0], section.x[0]);
    sum = kmp_sub(g, sum, kmp_div(g, kmp_mul(g, load.moment.x[2], offset.x[1]), section.x[1]));
    return kmp_add(g, sum, kmp_div(g, kmp_mul(g, load.moment.x[1], offset.x[2]), section.x[2]));
}

kmp_vec kmp_section_strained(const kmp_tree *tree, int point)
{
    kmp_graph *g = tree->graph;
    const kempe_model *model = tree->model;
    const kmp_flexible *flexible = &model->flexibles[model->bodies[model->points[point].body].flexible - 1];
    const kmp_number *row = flexible->stations[station_of(model, point)].strained;
    kmp_vec moment = kmp_vec_zero();
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < flexible->count; k++) {
            const kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)(flexible->first + k));
            moment.x[c] = kmp_add(g, moment.x[c], kmp_mul(g, kmp_tree_number(tree, &row[c * flexible->count + k]), q));
        }
    return moment;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static bool is_of_joint(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_MEASURE &&
           (expr->measure->kind == KMP_MEASURE_JOINT_REACTION || expr->measure->kind == KMP_MEASURE_JOINT_MOMENT ||
            expr->measure->kind == KMP_MEASURE_BEARING);
}

static bool is_wanted(const kempe_model *model)
{
    bool wanted = false;
    for (int k = 0; k < model->output_count; k++)
        wanted = wanted || model->outputs[k].kind == KMP_OUTPUT_JOINT_REACTION ||
                 model->outputs[k].kind == KMP_OUTPUT_JOINT_MOMENT || model->outputs[k].kind == KMP_OUTPUT_BEARING ||
                 model->outputs[k].kind == KMP_OUTPUT_SECTION || model->outputs[k].kind == KMP_OUTPUT_STRESS;
    for (int k = 0; k < model->sensor_count; k++)
        wanted = wanted || kmp_expr_find(model->sensors[k].expr, is_of_joint, NULL);
    for (int k = 0; k < model->run.until_count; k++)
        wanted = wanted || kmp_expr_find(model->run.until[k], is_of_joint, NULL);
    return wanted;
}

/* The forces of compliant contacts, and what virtual motions need. False: no memory. */
static bool find_pressing(kmp_joint_loads *loads, const kmp_tree *tree)
{
    kmp_tree kinked = *tree;
    kmp_ref against[KMP_COMPLIANT_FORCES];
    kinked.conditions.kinks = kinked.conditions.watches = true; /* as in laws of forces */
    loads->against = KMP_GRAPH_NEW(tree->graph, kmp_ref, KMP_COMPLIANT_FORCES * tree->model->force_count + 1);
    for (int i = 0; loads->against && i < loads->pressing_count; i++)
        (void)kmp_compliant_forces(&kinked, &tree->model->forces[loads->pressing[i]], against,
                                   loads->against + (ptrdiff_t)KMP_COMPLIANT_FORCES * loads->pressing[i]);
    for (uint32_t k = 0; k < 3; k++)
        loads->spin.x[k] = kmp_input(tree->graph, KMP_IN_ALONG, VIRTUAL + 3 + k);
    return loads->against && kmp_tree_seeds_along(tree, VIRTUAL, &loads->seeds);
}

kempe_status kmp_joint_loads_begin(kmp_equations *eq, bool all)
{
    kmp_tree *tree = &eq->tree;
    kmp_graph *g = eq->graph;
    if (!all && !is_wanted(eq->model))
        return KEMPE_OK;
    kmp_joint_loads *loads = KMP_GRAPH_NEW(g, kmp_joint_loads, 1);
    kmp_link_motion *movement = KMP_GRAPH_NEW(g, kmp_link_motion, tree->count);
    kmp_ref *qdd = KMP_GRAPH_NEW(g, kmp_ref, eq->n + 1), *effort = KMP_GRAPH_NEW(g, kmp_ref, eq->n + 1);
    KMP_TRY(kmp_made(eq->context, loads && movement && qdd && effort));
    kmp_forces_init(&loads->forces, tree, 0, NULL);
    loads->inertial = KMP_GRAPH_NEW(g, kmp_wrench, tree->count);
    loads->of = KMP_GRAPH_NEW(g, kmp_wrench, eq->model->body_count);
    loads->known = KMP_GRAPH_NEW(g, bool, eq->model->body_count);
    list_elements(loads, tree);
    list_gears(loads, tree);
    list_crossing(&loads->closures, tree, eq->model->closure_count, closure_place);
    list_crossing(&loads->elements, tree, eq->model->force_count, element_place);
    list_crossing(&loads->presses, tree, eq->model->force_count, pressing_place);
    KMP_TRY(kmp_made(eq->context, !kmp_graph_failed(g) && find_pressing(loads, tree)));
    for (int k = 0; k < eq->n; k++)
        qdd[k] = kmp_input(g, KMP_IN_QDD, (uint32_t)k);
    kmp_newton_euler_whole(tree, qdd, loads->forces.applied, movement, loads->inertial, effort);
    loads->qdd = qdd;
    loads->motion = movement;
    tree->reactions.joints = loads;
    tree->reactions.of_joint = kmp_joint_load;
    if (all)
        find_axes(loads, tree);
    return KEMPE_OK;
}

void kmp_joint_loads_end(kmp_equations *eq)
{
    eq->tree.reactions.joints = NULL;
}
