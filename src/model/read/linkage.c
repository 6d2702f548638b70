/* SPDX-License-Identifier: BSD-3-Clause */
/* The spanning tree of the graph of bodies, by Prim's algorithm (Bell System Technical Journal 36 (1957) 1389-1401)
 * from the ground. Of all joints with one end reached it takes the first in rank, then the nearest to the ground, then
 * the first in the file. The rank is the number of rows of the joint's cut, so that all cuts together have the fewest
 * rows (a spanning tree of greatest weight). Joints that must stay are first of all. */
#include "model/read/linkage.h"
#include "model/read/read_include.h"
#include "model/read/read_ports.h"
#include <ctype.h>
#include <string.h>

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

/* Its other body. */
static int edge_far_end(const kmp_edge *edge, int body)
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
            from = edge_far_end(&g->edges[g->by[from]], from);
        } else {
            down[tail++] = g->by[to];
            to = edge_far_end(&g->edges[g->by[to]], to);
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
            there = edge_far_end(edge, here);
            if (there == to || g->by[there] >= 0)
                continue;
            g->by[there] = e;
            g->order[count++] = there;
        }
    for (int b = from; b != to; b = edge_far_end(&g->edges[g->by[b]], b))
        g->path[length++] = g->by[b];
    return length;
}

int kmp_linkage_path(kmp_linkage *g, int from, int to)
{
    return g->depth[0] < 0 ? path_among_staying(g, from, to) : path_in_tree(g, from, to);
}

/* -- joints in messages ------------------------------------------------------------------------------- */

const char *kmp_edge_what(kmp_reader *r, const kmp_edge *edge)
{
    return edge->own ? kmp_reader_say(r, "the joint of body '%s'", edge->key->text)
                     : kmp_reader_say(r, "joint '%s'", edge->name);
}

/* Its name and the reason: "A (force 'motor' acts on it)". */
static const char *edge_name_reason(kmp_reader *r, const kmp_edge *edge)
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
        from = edge_far_end(&g->edges[g->path[k]], from);
        names = kmp_reader_say(r, "%s - %s", names, g->body_names[from]);
    }
    return names;
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
    const char *reasons = edge_name_reason(r, edge);
    for (int k = 0; k < count; k++)
        reasons = kmp_reader_say(r, "%s, %s", reasons, edge_name_reason(r, &g->edges[g->path[k]]));
    kmp_reader_complain(r, edge->key->place,
                        "%s: none of the joints of the loop %s can be cut: %s; allow one of them to be cut",
                        kmp_edge_what(r, edge), bodies, reasons);
    edge->faulty = true;
}

/* The place of the key `cut` of the joint, or of the joint. */
static kmp_place place_of_cut(const kmp_edge *edge)
{
    const kmp_yaml *node = kmp_yaml_get(edge->map, "cut");
    return node ? node->place : edge->key->place;
}

/* Reports a joint that the user cuts but that cannot be cut. */
static void check_wish(kmp_reader *r, kmp_linkage *g, kmp_edge *edge)
{
    if (edge->faulty || edge->wish != KMP_CUT_YES || !must_stay(edge))
        return;
    if (!edge->cut)
        kmp_reader_complain(
            r, place_of_cut(edge),
            "%s: a %s cannot be cut, because there is no equivalent closure: cut another joint of its loop",
            kmp_edge_what(r, edge), edge->kind->name);
    else
        kmp_reader_complain(r, place_of_cut(edge), "%s: a cut joint has no coordinate, but %s: remove one of the two",
                            kmp_edge_what(r, edge), edge->need);
    edge->faulty = g->broken = true;
}

static void join_staying(kmp_reader *r, kmp_linkage *g)
{
    for (int rank = 0; rank < 4; rank++)
        for (int e = 0; e < g->edge_count; e++) {
            kmp_edge *edge = &g->edges[e];
            /* Bodies' own joints first, then the user's requests, then joints without alternative. */
            const int own_rank = edge->own ? 0 : edge->wish == KMP_CUT_NO ? 1 : !edge->cut ? 2 : 3;
            if (edge->faulty || !must_stay(edge) || own_rank != rank)
                continue;
            if (join(g, edge))
                edge->stays = true;
            else
                complain_loop(r, g, edge);
        }
    for (int e = 0; e < g->edge_count;
         e++) { /* stops; the coordinate of a cut joint acts on a function of the others */
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
    if (g->edges[a].last != g->edges[b].last)
        return g->edges[b].last;
    return rank != 0 ? rank > 0 : depth != 0 ? depth < 0 : a < b;
}

static void let_wait(kmp_linkage *g, int e)
{
    int k = g->waiting_count++;
    kmp_edge *edge = &g->edges[e];
    edge->last = !edge->stays && edge->off[is_reached(g, edge->body[0]) ? 1 : 0];
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

static bool is_closure(const kmp_edge *edge)
{
    return edge->kind && edge->kind->closure;
}

/* A joint that is to be cut although only it connects further bodies, -1: none. */
static int bridge(const kmp_linkage *g)
{
    for (int e = 0; e < g->edge_count; e++)
        if (g->edges[e].wish == KMP_CUT_YES && !is_closure(&g->edges[e]) && !g->edges[e].faulty &&
            leads_on(g, &g->edges[e]))
            return e;
    return -1;
}

/* The kind of a joint without coordinates at a body; NULL: there is none. */
static const char *closure_at(const kmp_linkage *g, int body)
{
    for (int e = 0; e < g->edge_count; e++)
        if (is_closure(&g->edges[e]) && (g->edges[e].body[0] == body || g->edges[e].body[1] == body))
            return g->edges[e].kind->name;
    return NULL;
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
    else if (closure_at(g, body))
        kmp_reader_complain(
            r, g->body_keys[body]->place,
            "body '%s' is not connected: a %s has no coordinates; give the body a joint, such as joint: "
            "{free: x, at: ground}",
            g->body_names[body], closure_at(g, body));
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
        kmp_edge *edge = &g->edges[e];
        if (edge->wish == KMP_CUT_YES) {
            kmp_reader_complain(
                r, place_of_cut(edge), "%s: it cannot be cut: nothing else connects body '%s' to the ground",
                kmp_edge_what(r, edge), g->body_names[edge->body[is_reached(g, edge->body[0]) ? 1 : 0]]);
            edge->wish = KMP_CUT_CHOICE;
        }
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

/* -- why a joint is cut ------------------------------------------------------------------------------- */

/* Relations of the joints that could be cut as well, or not, to the one that is cut. */
enum { MORE, STARTED, NEARER, BEFORE, STAYING, RELATIONS };

static int relation_of(const kmp_linkage *g, const kmp_edge *cut, const kmp_edge *edge)
{
    if (edge->stays)
        return STAYING;
    if (edge->cut->rows > cut->cut->rows)
        return MORE;
    if (edge->start && !cut->start)
        return STARTED;
    const int a = g->depth[cut->body[0]], b = g->depth[cut->body[1]], reach = (a < b ? a : b) + cut->freedoms;
    return g->depth[edge->body[edge->reversed ? 0 : 1]] < reach ? NEARER : BEFORE;
}

const char *kmp_linkage_why(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut)
{
    static const char *const words[RELATIONS] = {"it has fewer constraint equations than",
                                                 "it has no start value, unlike", "it is farther from the ground than",
                                                 "it comes after", "not to be cut:"};
    const char *names[RELATIONS] = {NULL};
    kmp_text text = {0};
    if (cut->wish == KMP_CUT_YES)
        return cut->kind->closure ? "it has no coordinates" : "the model prescribes it (cut: yes)";
    if (cut->requested)
        return kmp_reader_say(r, "%s needs its reaction", cut->requested);
    if (cut->last)
        return "it does not hold the flexible body at its origin";
    int count = kmp_linkage_path(g, cut->body[0], cut->body[1]);
    for (int k = 0; k < count; k++) {
        const kmp_edge *edge = &g->edges[g->path[k]];
        int relation = relation_of(g, cut, edge);
        const char *name = relation == STAYING ? edge_name_reason(r, edge) : edge->name;
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

/* -- uses that ask for a coordinate or multipliers --------------------------------------------------- */

/* Joints that must have a coordinate, or multipliers, because the machine and its start use them. Outputs, sensors and
 * `until` change no tree. Expressions are only searched for `q(JOINT)` and similar text here; they are read when there
 * are coordinates. */

typedef struct search {
    kmp_reader *r;
    kmp_linkage *g;
    const char *reason; /* of the use found */
    bool stops;         /* it is one of contacts */
    kmp_edge **naming;  /* joints of the graph that name their coordinates */
    int naming_count;
} search;

static void find_naming(search *s)
{
    const kmp_linkage *g = s->g;
    s->naming = KMP_ARENA_NEW(&s->r->scratch, kmp_edge *, g->edge_count + 1);
    for (int k = g->own_count; s->naming && k < g->edge_count; k++) {
        const kmp_yaml *names = kmp_yaml_get(g->edges[k].map, "coordinates");
        if (names && names->kind == KMP_YAML_LIST)
            s->naming[s->naming_count++] = &g->edges[k];
    }
}

/* The joint of the graph that gives a coordinate this name; NULL: there is none. */
static kmp_edge *find_named(const search *s, const char *name)
{
    for (int k = 0; k < s->naming_count; k++) {
        const kmp_yaml *names = kmp_yaml_get(s->naming[k]->map, "coordinates");
        for (int i = 0; i < names->count; i++)
            if (names->items[i]->kind == KMP_YAML_SCALAR &&
                strcmp(kmp_reader_name(s->r, names->items[i]->place.file, names->items[i]->text), name) == 0)
                return s->naming[k];
    }
    return NULL;
}

/* The joint that a coordinate `JOINT`, `JOINT.k` or with its own name belongs to; NULL: none of `joints`. */
static kmp_edge *find_edge(const search *s, int file, const char *text, size_t length)
{
    const char *rest, *name = kmp_reader_say(s->r, "%.*s", (int)length, text);
    const kmp_yaml *port = kmp_port_bound(s->r, file, name, &rest);
    if (port) {
        file = port->place.file;
        text = kmp_reader_say(s->r, "%s%s", port->text, rest);
        length = strlen(text);
    }
    const char *dot = memchr(text, '.', length);
    if (dot && !isdigit((unsigned char)dot[1])) /* of a flexible body */
        return NULL;
    const char *said = kmp_reader_say(s->r, "%.*s", (int)(dot ? dot - text : (ptrdiff_t)length), text);
    const char *whole = kmp_reader_name(s->r, file, said);
    kmp_edge *edge = kmp_linkage_joint_named(s->r, s->g, whole);
    return edge || dot ? edge : find_named(s, whole);
}

static void need(const search *s, int file, const char *text, size_t length)
{
    kmp_edge *edge = find_edge(s, file, text, length);
    if (edge && (!edge->need || (edge->stopped && !s->stops))) {
        edge->need = s->reason;
        edge->stopped = s->stops;
    }
}

static void need_node(const search *s, const kmp_yaml *node)
{
    if (node && node->kind == KMP_YAML_SCALAR)
        need(s, node->place.file, node->text, strlen(node->text));
}

/* -- expressions ----------------------------------------------------------------------------------- */

static bool in_name(char c)
{
    return isalnum((unsigned char)c) || c == '_' || c == '.' || (c & 0x80);
}

static bool is_word(const char *text, size_t length, const char *const *words)
{
    for (int k = 0; words[k]; k++)
        if (strlen(words[k]) == length && strncmp(words[k], text, length) == 0)
            return true;
    return false;
}

static const char *skip_spaces(const char *s)
{
    return s + strspn(s, " \t");
}

const char *const kmp_words_of_loads[] = {"lambda", "reaction", "moment", NULL};

/* Every WORD(NAME) of a text. */
static void look_through(const search *s, const kmp_yaml *node)
{
    static const char *const coordinates[] = {"q", "qd", "qdd", "angle", NULL};
    for (const char *at = node->text; *at;) {
        if (!in_name(*at)) {
            at++;
            continue;
        }
        const char *word = at;
        while (in_name(*at))
            at++;
        size_t length = (size_t)(at - word), count = 0;
        const char *name = skip_spaces(at);
        if (*name != '(')
            continue;
        name = skip_spaces(name + 1);
        while (in_name(name[count]))
            count++;
        if (count == 0)
            continue;
        if (is_word(word, length, coordinates))
            need(s, node->text_place.file, name, count);
        kmp_edge *edge =
            is_word(word, length, kmp_words_of_loads) ? find_edge(s, node->text_place.file, name, count) : NULL;
        if (edge && !edge->requested)
            edge->requested = kmp_reader_say(s->r, "the expression %s", node->text);
    }
}

static void look_into(const search *s, const kmp_yaml *node)
{
    if (node->kind == KMP_YAML_SCALAR)
        look_through(s, node);
    for (int k = 0; k < node->count; k++)
        look_into(s, node->items[k]);
}

/* -- sections -------------------------------------------------------------------------------------- */

/* Searches entries whose `joint` is a coordinate, and which may contain expressions. */
static void search_entries(search *s, const char *section, const char *acts, const char *depends)
{
    const kmp_yaml *map = kmp_yaml_get(s->r->root, section);
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        s->reason = kmp_reader_say(s->r, acts, map->keys[k]->text);
        need_node(s, kmp_yaml_get(map->items[k], "joint"));
        s->reason = kmp_reader_say(s->r, depends, map->keys[k]->text);
        look_into(s, map->items[k]);
        const kmp_yaml *coupler = kmp_yaml_get(map->items[k], "coupler");
        for (int i = 0; coupler && coupler->kind == KMP_YAML_MAP && i < coupler->count; i++)
            need_node(s, coupler->keys[i]);
    }
}

static void search_list(search *s, const char *section, const char *key, const char *reason)
{
    const kmp_yaml *list = kmp_yaml_get(kmp_yaml_get(s->r->root, section), key);
    s->reason = reason;
    for (int k = 0; list && list->kind == KMP_YAML_LIST && k < list->count; k++)
        need_node(s, list->items[k]);
}

static void find_start(const search *s, const char *key)
{
    const kmp_yaml *map = kmp_yaml_get(kmp_yaml_get(s->r->root, "start"), key);
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        const kmp_yaml *name = map->keys[k];
        kmp_edge *edge = find_edge(s, name->place.file, name->text, strlen(name->text));
        if (edge && !edge->start)
            edge->start = name;
    }
}

/* The joints that gears name. */
static void search_gears(search *s)
{
    const kmp_yaml *map = kmp_yaml_get(s->r->root, "gears");
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        const kmp_yaml *wheels = kmp_yaml_get(map->items[k], "between");
        s->reason = kmp_reader_say(s->r, "gear '%s' turns it", map->keys[k]->text);
        for (int i = 0; wheels && wheels->kind == KMP_YAML_LIST && i < wheels->count; i++)
            need_node(s, wheels->items[i]);
    }
}

void kmp_linkage_find_uses(kmp_reader *r, kmp_linkage *g)
{
    search s = {.r = r, .g = g, .reason = ""};
    find_naming(&s);
    search_list(&s, "start", "hold", "the start holds it");
    const kmp_yaml *goals = kmp_yaml_get(kmp_yaml_get(r->root, "start"), "goals");
    s.reason = "the start has a goal for it";
    for (int k = 0; goals && goals->kind == KMP_YAML_MAP && k < goals->count; k++)
        need_node(&s, goals->keys[k]);
    search_list(&s, "run", "independent", "it is given as independent");
    search_entries(&s, "drives", "drive '%s' moves it", "drive '%s' depends on it");
    search_entries(&s, "forces", "force '%s' acts on it", "force '%s' depends on it");
    search_entries(&s, "loops", "loop '%s' depends on it", "loop '%s' depends on it");
    search_gears(&s);
    s.stops = true;
    search_entries(&s, "contacts", "contact '%s' acts on it", "contact '%s' depends on it");
    s.stops = false;
    search_entries(&s, "states", "state '%s' depends on it", "state '%s' depends on it");
    search_entries(&s, "algebraic", "variable '%s' depends on it", "variable '%s' depends on it");
    find_start(&s, "q");
    find_start(&s, "qd");
}
