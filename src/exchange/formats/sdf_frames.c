/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of SDFormat: names, the frame in which each is given, and included files. */
#include "exchange/formats/sdf_frames.h"
#include "base/arena.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "model/data/place.h"
#include "model/language/limits.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

const char *kmp_sdf_relative(const kmp_element *e, int version)
{
    const kmp_element *pose = kmp_element_find(e, "pose");
    const char *old = version < 107 ? kmp_element_text(pose, "frame") : NULL;
    return old ? old : kmp_element_text(pose, "relative_to");
}

kmp_pose kmp_sdf_pose(kmp_import *im, const kmp_element *e)
{
    kmp_pose f = kmp_frame_none();
    const kmp_element *pose = kmp_element_find(e, "pose");
    const char *format = kmp_element_text(pose, "rotation_format");
    bool quaternion = format && strcmp(format, "quat_xyzw") == 0;
    double value[7] = {0, 0, 0, 0, 0, 0, quaternion};
    if (format && !quaternion && strcmp(format, "euler_rpy") != 0)
        kmp_import_complain(im, pose->place, "rotation format", format, "is unknown; available: euler_rpy, quat_xyzw");
    if (pose)
        kmp_import_read_numbers(im, e, "pose", 6 + quaternion, 6 + quaternion, value);
    memcpy(f.p, value, sizeof f.p);
    const double wxyz[4] = {value[6], value[3], value[4], value[5]};
    for (int k = 3; k < 6 && kmp_element_says(pose, "degrees", true); k++)
        value[k] *= acos(-1) / 180;
    if (!quaternion)
        kmp_frame_rotate(value + 3, f.r);
    else if (!kmp_frame_turn(wxyz, f.r))
        kmp_import_complain(im, e->place, "pose", kmp_element_text(e, "pose"), "has a quaternion of length zero");
    return f;
}

/* -- files --------------------------------------------------------------------------------------------- */

const kmp_element *kmp_sdf_world(const kmp_element *file)
{
    const kmp_element *world = kmp_element_find(file, "world");
    return world ? world : file;
}

/* 1.4 to 1.11 as 104 to 111; 0 after a complaint. */
static int version_of(kmp_import *im, const kmp_element *file)
{
    const char *text = kmp_import_attribute(im, file, "version");
    char *end = NULL;
    long minor = text && strncmp(text, "1.", 2) == 0 ? strtol(text + 2, &end, 10) : 0;
    if (!text || (end && !*end && minor >= 4 && minor <= 11))
        return text ? 100 + (int)minor : 0;
    kmp_import_complain(im, file->place, "version", text, "of SDFormat is not read: from 1.4 to 1.11");
    return 0;
}

/* Messages about an included file name the place of its `include`. */
static void place_all(const kmp_element *e, kmp_place place)
{
    for (; e; e = e->next) {
        ((kmp_element *)e)->place = ((kmp_element *)e)->text_place = place;
        place_all(e->first, place);
    }
}

/* The outermost element of an included file; NULL after a complaint. */
static const kmp_element *load(kmp_sdf *s, const kmp_element *include, const char *path)
{
    kmp_import *im = s->im, inner = *im;
    kempe_context *aside = kempe_context_new(); /* its message becomes part of ours */
    char *text = NULL;
    size_t length = 0;
    kempe_status status = aside ? kmp_file_read(aside, KMP_FILE_INCLUDED, path, &text, &length) : KEMPE_E_MEMORY;
    inner.file = path;
    inner.model = NULL;
    if (status == KEMPE_E_MEMORY)
        im->arena->failed = true;
    else if (status != KEMPE_OK)
        kmp_import_complain(im, include->place, "included file", path, kempe_context_message(aside));
    else if ((status = kmp_xml_load(im->context, im->arena, path, include->place.file, text, length, NULL,
                                    &inner.model)) != KEMPE_OK)
        im->status = status;
    if (inner.model)
        place_all(inner.model, include->place);
    if (status == KEMPE_OK && inner.model && strcmp(inner.model->name, "sdf") == 0)
        kmp_import_note_unknown(&inner);
    im->refused = inner.refused;
    kmp_free(text);
    kempe_context_free(aside);
    return inner.model;
}

/* -- frames -------------------------------------------------------------------------------------------- */

static void collect(kmp_sdf *s, const kmp_element *from, int model, int version, int level);

/* Adds a frame with its names; KMP_SDF_NONE: a complaint. */
static int add_frame(kmp_sdf *s, kmp_sdf_kind kind, const kmp_element *e, const char *name, int model, int version)
{
    kmp_import *im = s->im;
    kmp_sdf_frame *list = name ? kmp_arena_room(im->arena, s->frames, s->count, sizeof *list) : NULL;
    if (!list)
        return KMP_SDF_NONE;
    s->frames = list;
    const char *scoped = model >= 0 ? kmp_arena_printf(im->arena, "%s::%s", list[model].scoped, name)
                                    : kmp_arena_strdup(im->arena, name);
    const char *shown = scoped ? kmp_import_clean(im, scoped + (model >= 0 ? s->hidden : 0)) : NULL;
    if (!shown)
        return KMP_SDF_NONE;
    if (kind != KMP_SDF_JOINT && kind != KMP_SDF_FRAME && model >= 0 && list[model].first == KMP_SDF_NONE)
        list[model].first = s->count;
    list[s->count] = (kmp_sdf_frame){.kind = kind,
                                     .element = e,
                                     .placed = e,
                                     .scoped = scoped,
                                     .name = shown,
                                     .version = version,
                                     .model = model,
                                     .first = KMP_SDF_NONE};
    return s->count++;
}

static void add_model(kmp_sdf *s, const kmp_element *e, const kmp_element *placed, const char *name, int model,
                      int version, int level)
{
    int k = add_frame(s, KMP_SDF_MODEL, e, name, model, version);
    if (k < 0)
        return;
    s->frames[k].placed = placed;
    s->frames[k].fixed = kmp_element_says(kmp_element_find(placed, "static") ? placed : e, "static", true) ||
                         (model >= 0 && s->frames[model].fixed);
    collect(s, e, k, version, level);
}

static void add_included(kmp_sdf *s, const kmp_element *include, int model, int level)
{
    kmp_import *im = s->im;
    const char *uri = kmp_import_attribute(im, include, "uri"), *name = kmp_element_text(include, "name");
    if (!uri)
        return;
    if (strstr(uri, "://") || kmp_path_is_whole(uri)) {
        kmp_import_complain(
            im, include->place, "include", uri,
            "is not a file in this folder: only relative names are read; copy the model into the folder");
        return;
    }
    if (kmp_element_says(include, "merge", true)) {
        kmp_import_complain(im, include->place, "include", uri, "cannot be merged: remove the attribute 'merge'");
        return;
    }
    if (level >= KMP_MOST_INCLUDE_LEVELS || ++s->includes > KMP_MOST_INCLUDES) {
        kmp_import_complain(im, include->place, "include", uri,
                            "includes itself, directly or through other files, or there are too many of them");
        return;
    }
    const int folder = (int)kmp_path_folder(im->file);
    const char *path = folder > 0 ? kmp_arena_printf(im->arena, "%.*s%s", folder, im->file, uri) : uri;
    const kmp_element *file = path ? load(s, include, path) : NULL, *e = kmp_element_find(file, "model");
    int version = file && strcmp(file->name, "sdf") == 0 ? version_of(im, file) : 0;
    if (!file || !version || !e || kmp_element_again(e)) {
        if (im->status == KEMPE_OK)
            kmp_import_complain(im, include->place, "included file", uri, "is not a file of SDFormat with one model");
        return;
    }
    const char *outer = im->file;
    im->file = path; /* for the files that it includes itself */
    add_model(s, e, include, name ? name : kmp_import_attribute(im, e, "name"), model, version, level + 1);
    im->file = outer;
}

static void collect(kmp_sdf *s, const kmp_element *from, int model, int version, int level)
{
    for (const kmp_element *e = from->first; e && s->im->status == KEMPE_OK; e = e->next) {
        bool joint = strcmp(e->name, "joint") == 0 || strcmp(e->name, "drake:joint") == 0,
             link = strcmp(e->name, "link") == 0 && model >= 0;
        if (strcmp(e->name, "model") == 0)
            add_model(s, e, e, kmp_import_attribute(s->im, e, "name"), model, version, level);
        else if (strcmp(e->name, "include") == 0)
            add_included(s, e, model, level);
        else if (joint || link || strcmp(e->name, "frame") == 0) {
            int k = add_frame(s,
                              joint  ? KMP_SDF_JOINT
                              : link ? KMP_SDF_LINK
                                     : KMP_SDF_FRAME,
                              e, kmp_import_attribute(s->im, e, "name"), model, version);
            const int first = link && k >= 0 ? s->frames[model].first : KMP_SDF_NONE;
            if (first >= 0 && s->frames[first].kind == KMP_SDF_MODEL)
                s->frames[model].first = k; /* a nested model has its place only while there is no own link */
        }
    }
}

/* -- names --------------------------------------------------------------------------------------------- */

static const char *scoped_of(const void *frames, int k)
{
    return ((const kmp_sdf_frame *)frames)[k].scoped;
}

/* The frames of entries k - 1 and k; true: they have one name. */
static bool are_equal(const kmp_sdf *s, int k, kmp_sdf_frame *pair[2])
{
    const struct kmp_import_entry *entry = &s->by_name.entry[k];
    pair[0] = &s->frames[entry[-1].number];
    pair[1] = &s->frames[entry[0].number];
    return strcmp(entry[-1].name, entry[0].name) == 0;
}

static int find(const kmp_sdf *s, const char *scoped)
{
    int k = kmp_import_index_find(&s->by_name, scoped);
    return k >= 0 ? k : KMP_SDF_NONE;
}

int kmp_sdf_frame_named(kmp_sdf *s, int model, const char *name, const kmp_element *at)
{
    static const char own[] = "__model__";
    size_t length = strlen(name), tail = sizeof own - 1;
    if (strcmp(name, "world") == 0)
        return KMP_SDF_WORLD;
    if (strcmp(name, own) == 0)
        return model;
    const char *scoped = model >= 0 ? kmp_arena_printf(s->im->arena, "%s::%s", s->frames[model].scoped, name) : name;
    int found = scoped ? find(s, scoped) : KMP_SDF_NONE;
    if (found == KMP_SDF_NONE && scoped && length > tail + 2 && strcmp(name + length - tail, own) == 0) {
        scoped = kmp_arena_printf(s->im->arena, "%.*s", (int)(strlen(scoped) - tail - 2), scoped); /* a model inside */
        found = scoped ? find(s, scoped) : KMP_SDF_NONE;
    }
    if (found == KMP_SDF_NONE)
        kmp_import_complain(s->im, at->place, "frame", name, "does not exist");
    return found;
}

int kmp_sdf_frame_of(kmp_sdf *s, int model, const kmp_element *e, const char *key)
{
    const char *name = kmp_import_attribute(s->im, e, key);
    return name ? kmp_sdf_frame_named(s, model, name, kmp_element_find(e, key)) : KMP_SDF_NONE;
}

/* -- places -------------------------------------------------------------------------------------------- */

/* The frame in which a frame is given without `relative_to`. */
static int usual_frame(kmp_sdf *s, const kmp_sdf_frame *f)
{
    const char *attached = kmp_element_text(f->element, "attached_to");
    if (f->kind == KMP_SDF_JOINT)
        return f->end[1];
    if (f->kind == KMP_SDF_FRAME && attached)
        return kmp_sdf_frame_named(s, f->model, attached, f->element);
    return f->model;
}

/* The number of frames from each to the world. */
static void find_depths(kmp_sdf *s)
{
    for (int k = 0; k < s->count; k++) {
        int steps = 0, at = k;
        while (at >= 0 && s->frames[at].depth == 0 && steps <= s->count) {
            at = s->frames[at].up;
            steps++;
        }
        if (steps > s->count) {
            kmp_import_complain(s->im, s->frames[k].element->place, "frame", s->frames[k].scoped,
                                "is given relative to itself, directly or through other frames");
            return;
        }
        int depth = (at >= 0 ? s->frames[at].depth : 0) + steps;
        for (at = k; at >= 0 && s->frames[at].depth == 0; at = s->frames[at].up)
            s->frames[at].depth = depth--;
    }
}

/* The pose of a model with a placement frame is the pose of this frame. */
static void place_model(kmp_sdf *s, int model)
{
    kmp_sdf_frame *m = &s->frames[model];
    const char *name = kmp_element_text(m->placed, "placement_frame");
    name = name ? name : kmp_element_text(m->element, "placement_frame");
    int frame = name ? kmp_sdf_frame_named(s, model, name, m->placed) : model, at = frame;
    while (at >= 0 && at != model)
        at = s->frames[at].up;
    if (at != model) {
        kmp_import_complain(s->im, m->placed->place, "placement frame", name, "is not given relative to its model");
        return;
    }
    kmp_pose inside = kmp_sdf_between(s, model, frame), back = kmp_frame_inverse(&inside);
    if (frame != model)
        m->pose = kmp_frame_in(&m->pose, &back);
}

static void sort_names(kmp_sdf *s)
{
    kmp_sdf_frame *pair[2];
    s->by_name = kmp_import_index_of(s->im, s->count, scoped_of, s->frames);
    /* Before 1.7 a joint may have the name of a link; nothing refers to it then. */
    for (int k = 1; k < s->by_name.count; k++)
        for (int i = 0; i < 2; i++)
            if (are_equal(s, k, pair) && pair[i]->version < 107 && pair[i]->kind == KMP_SDF_JOINT &&
                pair[1 - i]->kind != KMP_SDF_JOINT) {
                const char *other = kmp_arena_printf(s->im->arena, "%s joint", pair[i]->scoped);
                pair[i]->scoped = other ? other : pair[i]->scoped;
            }
    s->by_name = kmp_import_index_of(s->im, s->count, scoped_of, s->frames);
    for (int k = 1; k < s->by_name.count; k++)
        if (are_equal(s, k, pair))
            kmp_import_complain(s->im, pair[1]->element->place, "the name", pair[1]->scoped,
                                "exists twice: links, joints, frames and models share their names");
}

static void find_up(kmp_sdf *s, kmp_sdf_frame *f)
{
    kmp_import *im = s->im;
    const char *given = kmp_sdf_relative(f->placed, f->version);
    if (f->kind == KMP_SDF_JOINT) {
        bool drake = strcmp(f->element->name, "joint") != 0;
        f->end[0] = kmp_sdf_frame_of(s, f->model, f->element, drake ? "drake:parent" : "parent");
        f->end[1] = kmp_sdf_frame_of(s, f->model, f->element, drake ? "drake:child" : "child");
    }
    f->up = given ? kmp_sdf_frame_named(s, f->model, given, f->placed) : usual_frame(s, f);
    f->pose = kmp_sdf_pose(im, f->placed);
}

void kmp_sdf_find_frames(kmp_sdf *s)
{
    kmp_import *im = s->im;
    const kmp_element *world = kmp_sdf_world(im->model);
    const kmp_element *model = kmp_element_find(world, "model"), *include = kmp_element_find(world, "include");
    const kmp_element *only = model ? model : include;
    const char *name = kmp_element_text(only, "name");
    if (only && name && !(model && include) && !kmp_element_again(only))
        s->hidden = strlen(name) + 2;
    int version = version_of(im, im->model);
    if (version)
        collect(s, world, KMP_SDF_WORLD, version, 0);
    if (im->status == KEMPE_OK)
        sort_names(s);
    for (int k = 0; im->status == KEMPE_OK && k < s->by_name.count; k++)
        find_up(s, &s->frames[k]);
    if (im->status == KEMPE_OK && s->by_name.entry)
        find_depths(s);
    for (int k = s->count - 1; k >= 0 && im->status == KEMPE_OK && s->by_name.entry; k--)
        if (s->frames[k].kind == KMP_SDF_MODEL)
            place_model(s, k);
}

static int depth_of(const kmp_sdf *s, int frame)
{
    return frame >= 0 ? s->frames[frame].depth : 0;
}

kmp_pose kmp_sdf_between(const kmp_sdf *s, int from, int to)
{
    kmp_pose near = kmp_frame_none(), far = near, back;
    while (from != to)
        if (depth_of(s, from) > depth_of(s, to)) {
            near = kmp_frame_in(&s->frames[from].pose, &near);
            from = s->frames[from].up;
        } else {
            far = kmp_frame_in(&s->frames[to].pose, &far);
            to = s->frames[to].up;
        }
    back = kmp_frame_inverse(&near);
    return kmp_frame_in(&back, &far);
}

/* -- links --------------------------------------------------------------------------------------------- */

bool kmp_sdf_is_fixed(const kmp_sdf *s, int frame)
{
    int model = frame >= 0 ? s->frames[frame].model : KMP_SDF_WORLD;
    return model >= 0 && s->frames[model].fixed;
}

/* The frame to which a frame is fixed; a link is fixed to itself. */
static int carrier(kmp_sdf *s, const kmp_sdf_frame *f)
{
    const char *attached = kmp_element_text(f->element, "attached_to"),
               *canonical = kmp_element_text(f->element, "canonical_link");
    int own = (int)(f - s->frames);
    switch (f->kind) {
    case KMP_SDF_MODEL:
        return canonical ? kmp_sdf_frame_named(s, own, canonical, f->element) : f->first;
    case KMP_SDF_JOINT:
        return f->end[1];
    case KMP_SDF_FRAME:
        return attached ? kmp_sdf_frame_named(s, f->model, attached, f->element) : f->model;
    default:
        return own;
    }
}

int kmp_sdf_link_of(kmp_sdf *s, int frame)
{
    int at = frame;
    for (int steps = 0; at >= 0 && s->frames[at].kind != KMP_SDF_LINK; steps++) {
        int next = carrier(s, &s->frames[at]);
        if (steps > s->count || (next == KMP_SDF_NONE && s->frames[at].kind == KMP_SDF_MODEL)) {
            kmp_import_complain(s->im, s->frames[frame].element->place, "frame", s->frames[frame].scoped,
                                "is attached to no link");
            return KMP_SDF_NONE;
        }
        at = next;
    }
    return at;
}

const char *kmp_sdf_point(kmp_sdf *s, const kmp_element *e, int frame, const char *name)
{
    int link = kmp_sdf_link_of(s, frame);
    if (link == KMP_SDF_NONE)
        return NULL;
    kmp_pose at = kmp_sdf_between(s, link, frame);
    return kmp_import_point(s->im, e->place, link >= 0 ? s->frames[link].name : "ground", name, &at);
}
