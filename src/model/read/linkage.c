/* SPDX-License-Identifier: BSD-3-Clause */
/* The spanning tree of the graph of bodies, by Prim's algorithm (Bell System Technical Journal 36 (1957) 1389-1401)
 * from the ground. Of all joints with one end reached it takes the first in rank, then the nearest to the ground, then
 * the first in the file. The rank is the number of rows of the joint's cut, so that all cuts together have the fewest
 * rows (a spanning tree of greatest weight). Joints that must stay are first of all. */
#include "model/read/linkage.h"

static bool must_stay(const kmp_edge *edge)
{
    return edge->own || edge->wish == KMP_CUT_NO || !edge->cut || (edge->need && !edge->stopped);
}

kmp_edge *kmp_linkage_joint_named(kmp_reader *r, kmp_linkage *g, const char *name)
{
    const kmp_name_list names = KMP_NAMES(g->edges + g->own_count, g->edge_count - g->own_count);
    int found = kmp_index_find(&g->joint_index, &r->scratch, names, -1, 0, name);
    return found < 0 ? NULL : &g->edges[g->own_count + found];
}

/* -- paths --------------------------------------------------------------------------------------- */

int kmp_edge_far_end(const kmp_edge *edge, int body)
{
    return edge->body[0] == body ? edge->body[1] : edge->body[0];
}

/* Finds the path in the tree, by the edges to which both bodies are attached. */
static int path_in_tree(kmp_linkage *g, int from, int to)
{
    int count = 0, tail = 0, *down = g->path + g->body_count;
    int *place = g->group; /* of a body in the order reached */
    for (int k = 0; k < g->body_count; k++)
        place[g->order[k]] = k;
    while (from != to)
        if (place[from] > place[to]) {
            g->path[count++] = g->by[from];
            from = kmp_edge_far_end(&g->edges[g->by[from]], from);
        } else {
            down[tail++] = g->by[to];
            to = kmp_edge_far_end(&g->edges[g->by[to]], to);
        }
    while (tail > 0)
        g->path[count++] = down[--tail];
    return count;
}

/* Finds the path among joints that must stay, breadth first; `by` and `order` are free for it until there is a tree. */
static int path_among_staying(kmp_linkage *g, int from, int to)
{
    int count = 1, length = 0;
    for (int b = 0; b < g->body_count; b++)
        g->by[b] = -1;
    g->order[0] = to;
    for (int k = 0; k < count; k++)
        for (int e = 0; e < g->edge_count; e++) {
            const kmp_edge *edge = &g->edges[e];
            int here = g->order[k], there;
            if (!edge->stays || (edge->body[0] != here && edge->body[1] != here))
                continue;
            there = kmp_edge_far_end(edge, here);
            if (there == to || g->by[there] >= 0)
                continue;
            g->by[there] = e;
            g->order[count++] = there;
        }
    for (int b = from; b != to; b = kmp_edge_far_end(&g->edges[g->by[b]], b))
        g->path[length++] = g->by[b];
    return length;
}

int kmp_linkage_path(kmp_linkage *g, int from, int to)
{
    return g->depth[0] < 0 ? path_among_staying(g, from, to) : path_in_tree(g, from, to);
}

/* -- joints that stay ---------------------------------------------------------------------------- */

static int root_of(const kmp_linkage *g, int body)
{
    while (g->group[body] != body)
        body = g->group[body] = g->group[g->group[body]];
    return body;
}

static bool join(kmp_linkage *g, const kmp_edge *edge)
{
    int a = root_of(g, edge->body[0]), b = root_of(g, edge->body[1]);
    g->group[a > b ? a : b] = a > b ? b : a;
    return a != b;
}

static void complain_loop(kmp_reader *r, kmp_linkage *g, kmp_edge *edge)
{
    int count = kmp_linkage_path(g, edge->body[0], edge->body[1]);
    const char *bodies = kmp_linkage_bodies(r, g, edge->body[0], count);
    const char *reasons = kmp_edge_name_reason(r, edge);
    for (int k = 0; k < count; k++)
        reasons = kmp_reader_say(r, "%s, %s", reasons, kmp_edge_name_reason(r, &g->edges[g->path[k]]));
    kmp_reader_complain(r, edge->key->place,
                        "%s: none of the joints of the loop %s can be cut: %s; permit the cut of one of them",
                        kmp_edge_what(r, edge), bodies, reasons);
    edge->faulty = true;
}

/* The place of a key of the joint, or of the joint. */
static kmp_place place_of(const kmp_edge *edge, const char *key)
{
    const kmp_yaml *node = kmp_yaml_get(edge->map, key);
    return node ? node->place : edge->key->place;
}

/* Reports a joint that the user cuts but that cannot be cut. */
static void check_wish(kmp_reader *r, kmp_linkage *g, kmp_edge *edge)
{
    if (edge->faulty || edge->wish != KMP_CUT_YES || !must_stay(edge))
        return;
    if (!edge->cut)
        kmp_reader_complain(
            r, place_of(edge, "cut"),
            "%s: a %s cannot be cut, because there is no equivalent closure: cut another joint of its loop",
            kmp_edge_what(r, edge), edge->kind->name);
    else
        kmp_reader_complain(r, place_of(edge, "cut"),
                            "%s: a cut joint has no coordinate, but %s: remove one of the two", kmp_edge_what(r, edge),
                            edge->need);
    edge->faulty = g->broken = true;
}

/* Bodies' own joints first, then the user's requests, then joints without alternative. */
static int rank_of_staying(const kmp_edge *edge)
{
    return edge->own ? 0 : edge->wish == KMP_CUT_NO ? 1 : !edge->cut ? 2 : 3;
}

static void join_staying(kmp_reader *r, kmp_linkage *g)
{
    for (int rank = 0; rank < 4; rank++)
        for (int e = 0; e < g->edge_count; e++) {
            kmp_edge *edge = &g->edges[e];
            if (edge->faulty || !must_stay(edge) || rank_of_staying(edge) != rank)
                continue;
            if (join(g, edge))
                edge->stays = true;
            else
                complain_loop(r, g, edge);
        }
    for (int e = 0; e < g->edge_count; e++) { /* stops; that of a cut joint acts on a function of the others */
        kmp_edge *edge = &g->edges[e];
        if (!edge->faulty && edge->stopped && !must_stay(edge) && edge->wish != KMP_CUT_YES)
            edge->stays = join(g, edge);
    }
}

/* -- the tree ------------------------------------------------------------------------------------ */

/* -1: not in the tree by default. */
static int rank_of(const kmp_edge *edge)
{
    if (edge->faulty || edge->wish == KMP_CUT_YES)
        return -1;
    if (edge->stays)
        return 1000;
    return edge->requested ? 0 : 2 * edge->cut->rows + (edge->start != NULL);
}

static bool is_reached(const kmp_linkage *g, int body)
{
    return g->depth[body] >= 0;
}

/* True if exactly one end of the joint is reached. */
static bool leads_on(const kmp_linkage *g, const kmp_edge *edge)
{
    return is_reached(g, edge->body[0]) != is_reached(g, edge->body[1]);
}

static int depth_beyond(const kmp_linkage *g, const kmp_edge *edge)
{
    int from = edge->body[is_reached(g, edge->body[0]) ? 0 : 1];
    return g->depth[from] + edge->freedoms;
}

/* True if the tree takes edge a before edge b. */
static bool goes_before(const kmp_linkage *g, int a, int b)
{
    int rank = rank_of(&g->edges[a]) - rank_of(&g->edges[b]), depth = g->reach[a] - g->reach[b];
    return rank != 0 ? rank > 0 : depth != 0 ? depth < 0 : a < b;
}

static void let_wait(kmp_linkage *g, int e)
{
    int k = g->waiting_count++;
    g->reach[e] = depth_beyond(g, &g->edges[e]);
    for (; k > 0 && goes_before(g, e, g->waiting[(k - 1) / 2]); k = (k - 1) / 2)
        g->waiting[k] = g->waiting[(k - 1) / 2];
    g->waiting[k] = e;
}

/* The edge by which the tree grows, -1: none does. */
static int next_edge(kmp_linkage *g)
{
    int best = -1;
    while (g->waiting_count > 0 && (best < 0 || !leads_on(g, &g->edges[best]))) {
        int last = g->waiting[--g->waiting_count], k = 0;
        best = g->waiting[0];
        for (int below = 1; below < g->waiting_count; below = 2 * k + 1) {
            below += below + 1 < g->waiting_count && goes_before(g, g->waiting[below + 1], g->waiting[below]);
            if (!goes_before(g, g->waiting[below], last))
                break;
            g->waiting[k] = g->waiting[below];
            k = below;
        }
        g->waiting[k] = last;
    }
    return best >= 0 && leads_on(g, &g->edges[best]) ? best : -1;
}

/* Counts a body as reached; the edges that lead on from it wait. */
static void arrive(kmp_linkage *g, int body, int depth, int *reached)
{
    g->depth[body] = depth;
    g->order[(*reached)++] = body;
    for (int end = g->first[body]; end >= 0; end = g->next[end])
        if (rank_of(&g->edges[end / 2]) >= 0 && leads_on(g, &g->edges[end / 2]))
            let_wait(g, end / 2);
}

static void hang_by(kmp_linkage *g, int e, int *reached)
{
    kmp_edge *edge = &g->edges[e];
    edge->tree = true;
    edge->reversed = is_reached(g, edge->body[1]);
    int body = edge->body[edge->reversed ? 0 : 1];
    g->by[body] = e;
    arrive(g, body, depth_beyond(g, edge), reached);
}

/* A joint that is to be cut although it alone connects further bodies, -1: none. */
static int bridge(const kmp_linkage *g)
{
    for (int e = 0; e < g->edge_count; e++)
        if (g->edges[e].wish == KMP_CUT_YES && !g->edges[e].faulty && leads_on(g, &g->edges[e]))
            return e;
    return -1;
}

static void complain_bridge(kmp_reader *r, kmp_linkage *g, kmp_edge *edge)
{
    const char *body = g->body_names[edge->body[is_reached(g, edge->body[0]) ? 1 : 0]];
    kmp_reader_complain(r, place_of(edge, "cut"), "%s: it cannot be cut: nothing else connects body '%s' to the ground",
                        kmp_edge_what(r, edge), body);
    edge->wish = KMP_CUT_CHOICE;
}

/* The bodies that are joined to `body` and not to the ground, which count as reached from now on. */
static const char *lost_with(kmp_reader *r, kmp_linkage *g, int body, int *reached)
{
    int first = *reached;
    const char *names = g->body_names[body];
    arrive(g, body, 0, reached);
    for (int e = next_edge(g); e >= 0; e = next_edge(g)) {
        hang_by(g, e, reached);
        names = kmp_reader_say(r, "%s, %s", names, g->body_names[g->order[*reached - 1]]);
    }
    return *reached - first > 1 ? names : NULL;
}

static void complain_lost(kmp_reader *r, kmp_linkage *g, int body, int *reached)
{
    bool named = g->first[body] >= 0;
    const char *names = lost_with(r, g, body, reached);
    if (g->broken)
        return;
    if (!named)
        kmp_reader_complain(r, g->body_maps[body]->place,
                            "body '%s' has no key 'joint', and no joint of 'joints' connects it", g->body_names[body]);
    else
        kmp_reader_complain(r, g->body_keys[body]->place,
                            "body '%s' is not connected: no chain of joints connects %s to the ground",
                            g->body_names[body], names ? names : "it");
}

static void grow(kmp_reader *r, kmp_linkage *g)
{
    int reached = 0;
    for (int b = 0; b < g->body_count; b++) {
        g->depth[b] = g->by[b] = g->first[b] = -1;
        g->group[b] = b;
    }
    for (int end = 2 * g->edge_count - 1; end >= 0; end--) {
        int body = g->edges[end / 2].body[end % 2];
        if (body >= 0) {
            g->next[end] = g->first[body];
            g->first[body] = end;
        }
    }
    arrive(g, 0, 0, &reached);
    for (int e = next_edge(g); e >= 0 || (e = bridge(g)) >= 0; e = next_edge(g)) {
        if (g->edges[e].wish == KMP_CUT_YES)
            complain_bridge(r, g, &g->edges[e]);
        hang_by(g, e, &reached);
    }
    for (int b = 1; b < g->body_count; b++)
        if (!is_reached(g, b))
            complain_lost(r, g, b, &reached);
}

void kmp_linkage_choose(kmp_reader *r, kmp_linkage *g)
{
    for (int b = 0; b < g->body_count; b++) {
        g->depth[b] = -1;
        g->group[b] = b;
    }
    for (int e = 0; e < g->edge_count; e++)
        check_wish(r, g, &g->edges[e]);
    join_staying(r, g);
    grow(r, g);
}

/* Messages about the choice of the tree. */

const char *kmp_edge_what(kmp_reader *r, const kmp_edge *edge)
{
    return edge->own ? kmp_reader_say(r, "the joint of body '%s'", edge->key->text)
                     : kmp_reader_say(r, "joint '%s'", edge->name);
}

const char *kmp_edge_name_reason(kmp_reader *r, const kmp_edge *edge)
{
    const char *reason = edge->need ? edge->need : "";
    if (edge->own)
        reason = kmp_reader_say(r, "it is defined in body '%s'", edge->key->text);
    else if (edge->wish == KMP_CUT_NO)
        reason = "cut: no";
    else if (!edge->cut)
        reason = kmp_reader_say(r, "a %s cannot be cut", edge->kind ? edge->kind->name : "joint of motions");
    return kmp_reader_say(r, "%s (%s)", edge->name, reason);
}

const char *kmp_linkage_bodies(kmp_reader *r, const kmp_linkage *g, int from, int count)
{
    const char *names = g->body_names[from];
    for (int k = 0; k < count; k++) {
        from = kmp_edge_far_end(&g->edges[g->path[k]], from);
        names = kmp_reader_say(r, "%s - %s", names, g->body_names[from]);
    }
    return names;
}

/* Relations of the joints that could be cut as well, or not, to the one that is cut. */
enum { MORE, STARTED, NEARER, BEFORE, STAYING, RELATIONS };

static int reach_of_cut(const kmp_linkage *g, const kmp_edge *cut)
{
    int a = g->depth[cut->body[0]], b = g->depth[cut->body[1]];
    return (a < b ? a : b) + cut->freedoms;
}

static int relation_of(const kmp_linkage *g, const kmp_edge *cut, const kmp_edge *edge)
{
    if (edge->stays)
        return STAYING;
    if (edge->cut->rows > cut->cut->rows)
        return MORE;
    if (edge->start && !cut->start)
        return STARTED;
    return g->depth[edge->body[edge->reversed ? 0 : 1]] < reach_of_cut(g, cut) ? NEARER : BEFORE;
}

const char *kmp_linkage_why(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut)
{
    static const char *const words[RELATIONS] = {"it has fewer rows than", "it has no start value, unlike",
                                                 "it is farther from the ground than", "it comes after",
                                                 "not to be cut:"};
    const char *names[RELATIONS] = {NULL};
    kmp_text text = {0};
    if (cut->wish == KMP_CUT_YES)
        return "the model prescribes it (cut: yes)";
    if (cut->requested)
        return kmp_reader_say(r, "%s needs its reaction", cut->requested);
    int count = kmp_linkage_path(g, cut->body[0], cut->body[1]);
    for (int k = 0; k < count; k++) {
        const kmp_edge *edge = &g->edges[g->path[k]];
        int relation = relation_of(g, cut, edge);
        const char *name = relation == STAYING ? kmp_edge_name_reason(r, edge) : edge->name;
        names[relation] = names[relation] ? kmp_reader_say(r, "%s, %s", names[relation], name) : name;
    }
    for (int k = 0; k < RELATIONS; k++)
        if (names[k])
            kmp_text_printf(&text, "%s%s %s",
                            text.length > 0 ? "; "
                            : k == STAYING  ? "the others of its loop are "
                                            : "",
                            words[k], names[k]);
    return kmp_reader_take(r, &text);
}
