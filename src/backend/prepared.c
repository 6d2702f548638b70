/* SPDX-License-Identifier: BSD-3-Clause */
/* Layout and code of a program, made once for all threads, kept as a form of the program and as bytes in the cache.
 * Bytes from a file are checked in all their places before they are used. */
#include "backend/prepared.h"
#include "backend/encoder/packs.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <string.h>

#define NO_ROUTINE UINT32_MAX

bool kmp_code_is_straight(const kmp_instruction *in)
{
    return in->op == KMP_OP_ADD || in->op == KMP_OP_MUL || in->op == KMP_OP_DIV ||
           (in->op == KMP_OP_SQRT && !(in->a & 1));
}

/* -- the operations ---------------------------------------------------------------------------------- */

typedef struct lister {
    kmp_code *code;
    const kmp_layout *layout;
    uint8_t *kept; /* by instruction: read outside its segment's arithmetic */
    uint32_t count;
} lister;

/* Values that are read by functions, by other segments, or at the end. */
static void find_kept(lister *b)
{
    const kmp_layout *l = b->layout;
    const kmp_program *p = l->program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        uint32_t operand[3];
        for (int k = kmp_layout_operands(l, i, operand); k-- > 0;) {
            int j = kmp_layout_instruction(l, operand[k]);
            if (j >= 0 && (!kmp_code_is_straight(&p->instruction[i]) || !kmp_layout_together(l, i, j)))
                b->kept[j] = 1;
        }
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (kmp_layout_instruction(l, p->output[k]) >= 0)
            b->kept[kmp_layout_instruction(l, p->output[k])] = 1;
}

kmp_operation kmp_code_op(const kmp_instruction *in)
{
    switch (in->op) {
    case KMP_OP_MUL:
        return KMP_DO_MUL;
    case KMP_OP_DIV:
        return KMP_DO_DIV;
    case KMP_OP_SQRT:
        return KMP_DO_SQRT;
    default:
        return in->b & 1 ? KMP_DO_SUB : KMP_DO_ADD;
    }
}

static void add_operation(void *self, int i)
{
    lister *b = self;
    const kmp_layout *l = b->layout;
    uint32_t operand[3] = {0};
    int count = kmp_layout_operands(l, i, operand);
    kmp_straight *s = &b->code->operations[b->count++];
    *s = (kmp_straight){.op = (uint16_t)kmp_code_op(&l->program->instruction[i]),
                        .d = kmp_layout_target(l, i),
                        .x = count > 1 ? kmp_layout_slot(l, operand[0]) : 0,
                        .y = kmp_layout_slot(l, operand[count > 1]),
                        .kept = b->kept[i]};
    if (count == 3) {
        s->z = kmp_layout_slot(l, operand[2]);
        s->op = operand[0] & 1 ? KMP_DO_SUB_PRODUCT : operand[2] & 1 ? KMP_DO_PRODUCT_SUB : KMP_DO_PRODUCT_ADD;
    }
}

bool kmp_code_list(kmp_code *code, kmp_layout *l)
{
    int count = l->program->code[l->program->stages];
    lister b = {.code = code, .layout = l, .kept = KMP_ARENA_NEW(&l->arena, uint8_t, count)};
    *code = (kmp_code){0};
    code->operations = KMP_ARENA_NEW(&code->list, kmp_straight, count);
    code->start = KMP_ARENA_NEW(&code->list, uint32_t, l->frame->segment_count + 1);
    if (!b.kept || code->list.failed)
        return false;
    find_kept(&b);
    kmp_layout_visit(l, add_operation, &b, &b.count, code->start);
    return true;
}

/* -- machine code ------------------------------------------------------------------------------------ */

/* A segment's operations as they are written. */
typedef struct piece {
    uint32_t count;
    const kmp_straight *operations;
} piece;

/* USUAL_LENGTH: bytes of machine code of an operation, 5 to 9, with loads and stores. MOST_PACKED: larger programs run
 * from memory beyond the first cache, and the search for pairs takes longer than all else. */
enum { USUAL_LENGTH = 10, MOST_PACKED = 50000 };

static bool write_segments(const kmp_code *code, kmp_layout *l, kmp_written_code *written, uint32_t *offset)
{
    kmp_registers registers;
    uint32_t segments = l->frame->segment_count, slots = l->frame->slots;
    kmp_packs packs = {.slots = slots, .next = slots};
    piece *pieces = KMP_ARENA_NEW(&l->arena, piece, segments);
    if (!pieces)
        return false;
    /* The pieces of all segments, and the longest one. */
    uint32_t longest = 0;
    for (uint32_t g = 0; g < segments; g++) {
        pieces[g] = (piece){code->start[g + 1] - code->start[g], code->operations + code->start[g]};
        longest = pieces[g].count > longest ? pieces[g].count : longest;
    }
    bool packs_pay = written->form == KMP_CODE_ONE && l->frame->threads == 0 && code->start[segments] <= MOST_PACKED;
    if (packs_pay) {
        /* Puts equal operations side by side. */
        const kmp_frame *f = l->frame;
        uint32_t constants = KMP_FIRST_SLOT + (uint32_t)l->program->constant_count;
        bool ok = kmp_packs_init(&packs, &l->arena, written->encoder, f->slots, f->v, KMP_FIRST_SLOT, constants);
        for (uint32_t g = 0; ok && g < segments; g++)
            ok = kmp_packs_make(&packs, &pieces[g].count, &pieces[g].operations);
        if (!ok)
            return false;
    }
    for (uint32_t g = 0; g < segments; g++)
        longest = pieces[g].count > longest ? pieces[g].count : longest;
    if (!kmp_registers_init(&registers, &l->arena, packs.slots, packs.next, longest, l->frame->threads > 0))
        return false;
    for (uint32_t g = 0; g < segments; g++) {
        offset[g] = pieces[g].count > 0 ? (uint32_t)written->size : NO_ROUTINE;
        if (pieces[g].count > 0)
            kmp_registers_write(&registers, written, pieces[g].count, pieces[g].operations);
    }
    /* Pairs and values that leave registers have slots behind the others. */
    if (written->failed || written->size >= NO_ROUTINE ||
        !kmp_frame_extend(l->frame, packs.next - slots + registers.used))
        return false;
    for (int k = 0; k < packs.constants; k++)
        memcpy(l->frame->v + packs.constant[k].slot, packs.constant[k].value, sizeof packs.constant[k].value);
    return true;
}

void kmp_code_at(const void *pages, uint32_t offset, void *routine)
{
    const char *at = (const char *)pages + offset;
    memcpy(routine, &at, sizeof at);
}

/* Lets machine code run that begins at `offset` for each segment (NO_ROUTINE: it has no arithmetic), all in
 * `arena`. If it cannot run, `pages` stays NULL. false: no memory. */
static bool code_load(kmp_code *code, kmp_arena *arena, const void *bytes, size_t size, uint32_t segments,
                      const uint32_t *offset)
{
    code->segment = KMP_ARENA_NEW(arena, kmp_routine *, segments);
    code->pages = code->segment && size > 0 ? kmp_pages_new(bytes, size) : NULL;
    code->size = code->pages ? size : 0;
    for (uint32_t g = 0; code->pages && g < segments; g++)
        if (offset[g] != NO_ROUTINE)
            kmp_code_at(code->pages, offset[g], &code->segment[g]);
    return code->segment;
}

void kmp_code_free(kmp_code *code)
{
    kmp_arena_free(&code->list);
    kmp_pages_free(code->pages, code->size);
    *code = (kmp_code){0};
}

/* Operations of a program whose code is kept: smaller ones are written in less time than a file is read. */
enum { LEAST_KEPT = 3000 };

static void release(kmp_program_form *form)
{
    kmp_prepared *prepared = (kmp_prepared *)form;
    kmp_frame_free(&prepared->frame);
    kmp_code_free(&prepared->code);
    kmp_free(prepared);
}

/* -- writing ----------------------------------------------------------------------------------------- */

static bool write_code(kmp_prepared *prepared, const kmp_program *program, kmp_code_form form, int threads)
{
    kmp_layout layout = {0};
    kmp_code *code = &prepared->code;
    kmp_written_code written = {.encoder = kmp_encoder_here(), .form = form};
    bool ok =
        kmp_layout_init(&layout, &prepared->frame, program, kmp_code_is_straight, 0, &kmp_backend_native, threads) &&
        kmp_code_list(code, &layout);
    if (ok) {
        const uint32_t segments = prepared->frame.segment_count;
        written.expected = USUAL_LENGTH * (size_t)code->start[segments];
        code->offset = KMP_ARENA_NEW(&prepared->frame.arena, uint32_t, segments);
        ok = code->offset && write_segments(code, &layout, &written, code->offset) &&
             code_load(code, &prepared->frame.arena, written.code, written.size, segments, code->offset);
    }
    kmp_written_free(&written);
    kmp_layout_free(&layout);
    kmp_arena_free(&code->list);
    return ok;
}

static bool is_zero(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits == 0;
}

bool kmp_prepared_take_start(kmp_prepared *prepared)
{
    kmp_frame *f = &prepared->frame;
    uint32_t count = 0;
    for (uint32_t k = 0; k < f->slots; k++)
        count += !is_zero(f->v[k]);
    prepared->start = KMP_ARENA_NEW(&f->arena, kmp_slot_start, count);
    for (uint32_t k = 0; prepared->start && k < f->slots; k++)
        if (!is_zero(f->v[k]))
            prepared->start[prepared->start_count++] = (kmp_slot_start){f->v[k], k};
    kmp_arena_free(&f->values);
    f->v = NULL;
    return prepared->start;
}

/* -- as bytes: counts, arrays, code ---------------------------------------------------------------------- */

/* Places are checked where C uses them; the code is
 * trusted as the program that reads it is, whose file belongs only to the user, too (cache_files.h). */

/* Counts of the arrays; no gaps between them. */
typedef struct counts {
    uint32_t kind, slots, out, specials, angles, segments, blocks, items, copies, start;
    uint32_t threads, parts; /* entries of parts */
    uint64_t code;
} counts;

/* An array of a frame: its address, and its items. */
typedef struct array {
    void *to; /* where the address of its first item is */
    size_t size, count;
} array;

enum { ARRAYS = 15 };

static void list_arrays(kmp_prepared *prepared, const counts *c, array list[ARRAYS])
{
    kmp_frame *f = &prepared->frame;
    const size_t stages = (size_t)f->program->stages + 1, inputs = (size_t)f->program->input_count;
    const array all[ARRAYS] = {{&f->specials, sizeof *f->specials, c->specials},
                               {&f->angle, sizeof *f->angle, c->angles},
                               {&f->sine, sizeof *f->sine, c->angles},
                               {&f->cosine, sizeof *f->cosine, c->angles},
                               {&f->segments, sizeof *f->segments, (size_t)c->segments + 1},
                               {&f->stage, sizeof *f->stage, stages},
                               {&f->copy_start, sizeof *f->copy_start, stages},
                               {&f->copies, sizeof *f->copies, c->copies},
                               {&f->feeds, sizeof *f->feeds, inputs},
                               {&f->block_of, sizeof *f->block_of, c->blocks},
                               {&f->items, sizeof *f->items, c->items},
                               {&f->part_start, sizeof *f->part_start, c->threads > 0 ? stages : 0},
                               {&f->part_first, sizeof *f->part_first, c->parts},
                               {&prepared->start, sizeof *prepared->start, c->start},
                               {&prepared->code.offset, sizeof *prepared->code.offset, c->segments}};
    memcpy(list, all, sizeof all);
}

void kmp_prepared_put(kmp_bytes *bytes, kmp_prepared *prepared)
{
    const kmp_frame *f = &prepared->frame;
    const counts c = {.kind = (uint32_t)prepared->form.kind,
                      .slots = f->slots,
                      .out = f->out,
                      .specials = f->special_count,
                      .angles = f->angles,
                      .segments = f->segment_count,
                      .blocks = f->solving_count,
                      .items = f->item_count,
                      .copies = f->copy_start[f->program->stages],
                      .start = prepared->start_count,
                      .threads = (uint32_t)f->threads,
                      .parts = f->threads > 0 ? f->part_start[f->program->stages] : 0,
                      .code = prepared->code.size};
    array list[ARRAYS];
    list_arrays(prepared, &c, list);
    kmp_bytes_put(bytes, &c, sizeof c);
    KMP_BYTES_PUT(bytes, f->feed_start, KMP_IN_COUNT + 1);
    for (int k = 0; k < ARRAYS; k++) {
        const void *first;
        memcpy(&first, list[k].to, sizeof first);
        kmp_bytes_put(bytes, first, list[k].size * list[k].count);
    }
    kmp_bytes_put(bytes, prepared->code.pages, prepared->code.size);
}

/* -- checks ------------------------------------------------------------------------------------------ */

static bool are_below(uint32_t count, const uint32_t *list, uint64_t limit)
{
    bool good = true;
    for (uint32_t k = 0; k < count; k++)
        good = good && list[k] < limit;
    return good;
}

/* True if parts follow each other from zero to the end. */
static bool follow(uint32_t count, const uint32_t *first, uint32_t end)
{
    bool good = first[0] == 0 && first[count] == end;
    for (uint32_t k = 0; k < count; k++)
        good = good && first[k] <= first[k + 1];
    return good;
}

static bool are_segments(const kmp_frame *f)
{
    const kmp_segment *s = f->segments;
    bool good = s[0].special == 0 && s[f->segment_count].special == f->special_count;
    for (uint32_t g = 0; g < f->segment_count; g++)
        good = good && s[g].special <= s[g + 1].special && s[g].angle <= s[g + 1].angle &&
               (uint64_t)s[g].angle + s[g].angles <= f->angles && s[g + 1].angle <= f->angles;
    return good;
}

static bool are_specials(const kmp_frame *f)
{
    const kmp_program *p = f->program;
    bool good = true;
    for (uint32_t k = 0; good && k < f->special_count; k++) {
        const kmp_special *s = &f->specials[k];
        good = s->d < f->slots && s->instruction < (uint32_t)p->code[p->stages] &&
               p->instruction[s->instruction].op == s->op;
        if (good && s->op == KMP_OP_IMPLICIT)
            good = s->operand[1] < f->solving_count && f->block_of[s->operand[1]] == p->instruction[s->instruction].b &&
                   s->operand[0] + (uint64_t)p->block[p->instruction[s->instruction].b].arguments <= f->item_count;
        else
            good = good && are_below(3, s->operand, f->slots);
    }
    return good;
}

static bool are_slots(const kmp_prepared *prepared)
{
    const kmp_frame *f = &prepared->frame;
    bool good = (uint64_t)f->out + (uint64_t)f->program->outputs[f->program->stages] <= f->slots &&
                are_below(f->angles, f->angle, f->slots) && are_below(f->angles, f->sine, f->slots) &&
                are_below(f->angles, f->cosine, f->slots);
    for (uint32_t k = 0; k < f->copy_start[f->program->stages]; k++)
        good = good && f->copies[k].from < f->slots && f->copies[k].to < f->slots;
    for (int k = 0; k < f->program->input_count; k++)
        good = good && f->feeds[k].slot < f->slots;
    for (uint32_t k = 0; k < f->item_count; k++)
        good = good && f->items[k].slot < f->slots;
    for (uint32_t k = 0; k < prepared->start_count; k++)
        good = good && prepared->start[k].slot < f->slots;
    return good;
}

/* The inputs by kind, each with the index that the program has for it. */
static bool are_feeds(const kmp_frame *f)
{
    const kmp_program *p = f->program;
    int next = 0;
    bool good = f->feed_start[0] == 0 && f->feed_start[KMP_IN_COUNT] == p->input_count;
    for (int kind = 0; kind < KMP_IN_COUNT; kind++) {
        good = good && f->feed_start[kind] == next;
        for (int k = 0; good && k < p->input_count; k++)
            if ((int)p->input[k].kind == kind)
                good = f->feeds[next++].index == p->input[k].index;
    }
    return good;
}

/* Entries of each stage in parts are as in kmp_frame; a stage in one has none. */
static bool are_parts(const kmp_frame *f, uint32_t entries)
{
    const uint32_t *start = f->part_start;
    bool good = f->threads == 0 || follow((uint32_t)f->program->stages, start, entries);
    for (int s = 0; good && f->threads > 0 && s < f->program->stages; s++)
        if (start[s + 1] > start[s])
            good = start[s + 1] - start[s] > 3 &&
                   follow(start[s + 1] - start[s] - 1, f->part_first + start[s], f->stage[s + 1] - f->stage[s]);
    return good;
}

static bool is_sound(const kmp_prepared *prepared, size_t code)
{
    const kmp_frame *f = &prepared->frame;
    const kmp_program *p = f->program;
    bool good = follow((uint32_t)p->stages, f->stage, f->segment_count) &&
                follow((uint32_t)p->stages, f->copy_start, f->copy_start[p->stages]) && are_segments(f) &&
                are_below(f->solving_count, f->block_of, (uint64_t)p->block_count) && are_specials(f) &&
                are_slots(prepared) && are_feeds(f);
    for (uint32_t g = 0; g < f->segment_count; g++)
        good = good && (prepared->code.offset[g] < code || prepared->code.offset[g] == NO_ROUTINE);
    return good;
}

/* -- reading ----------------------------------------------------------------------------------------- */

static bool take_arrays(kmp_byte_source *s, kmp_prepared *prepared, const counts *c)
{
    array list[ARRAYS];
    list_arrays(prepared, c, list);
    for (int k = 0; k < ARRAYS; k++) {
        size_t left = (size_t)(s->end - s->at);
        void *first = list[k].count > left / list[k].size
                          ? NULL
                          : kmp_arena_alloc(&prepared->frame.arena, list[k].count, list[k].size);
        if (!first)
            return false;
        kmp_bytes_take(s, first, list[k].size * list[k].count);
        memcpy(list[k].to, &first, sizeof first);
    }
    return !s->failed;
}

bool kmp_prepared_take(kmp_byte_source *s, const kmp_program *program, kmp_prepared *prepared)
{
    kmp_frame *f = &prepared->frame;
    counts c;
    kmp_bytes_take(s, &c, sizeof c);
    *f = (kmp_frame){.program = program,
                     .slots = c.slots,
                     .out = c.out,
                     .special_count = c.specials,
                     .angles = c.angles,
                     .segment_count = c.segments,
                     .solving_count = c.blocks,
                     .item_count = c.items,
                     .threads = (int)c.threads,
                     .runner = kmp_layout_runner(&kmp_backend_native)};
    prepared->start_count = c.start;
    KMP_BYTES_TAKE(s, f->feed_start, KMP_IN_COUNT + 1);
    if (s->failed || c.kind != (uint32_t)prepared->form.kind || c.threads != c.kind / KMP_PREPARED_THREAD ||
        !take_arrays(s, prepared, &c) || f->copy_start[program->stages] != c.copies || !are_parts(f, c.parts) ||
        (uint64_t)(s->end - s->at) != c.code || !is_sound(prepared, (size_t)c.code))
        return false;
    return code_load(&prepared->code, &f->arena, s->at, (size_t)c.code, c.segments, prepared->code.offset) &&
           prepared->code.pages;
}

/* -- one for all ------------------------------------------------------------------------------------- */

static kmp_prepared *new_prepared(int kind)
{
    kmp_prepared *prepared = KMP_NEW(kmp_prepared, 1);
    if (prepared)
        prepared->form = (kmp_program_form){.kind = kind, .release = release};
    return prepared;
}

/* The folder and the key of a program's code; NULL: it is not kept. */
static const char *folder_of(const kmp_program *program, int kind, kmp_cache_key *key)
{
    return program->code[program->stages] < LEAST_KEPT ? NULL : kmp_program_folder(program, kind, key);
}

static kmp_prepared *make(const kmp_program *program, kmp_code_form form, int threads)
{
    kmp_cache_key key;
    int kind = kmp_prepared_kind(form, threads);
    const char *folder = folder_of(program, kind, &key);
    kmp_prepared *prepared = new_prepared(kind);
    if (!prepared)
        return NULL;
    if (!write_code(prepared, program, form, threads) || !kmp_prepared_take_start(prepared)) {
        release(&prepared->form);
        return NULL;
    }
    if (folder && prepared->code.pages) {
        kmp_bytes bytes = {0};
        kmp_prepared_put(&bytes, prepared);
        if (!bytes.failed)
            kmp_cache_write(folder, &key, bytes.at, bytes.size, KMP_CACHE_BYTES);
        kmp_bytes_free(&bytes);
    }
    return prepared;
}

/* That of the cache; NULL: none. */
static kmp_prepared *recalled(const kmp_program *program, int kind)
{
    kmp_cache_key key;
    const char *folder = folder_of(program, kind, &key);
    kmp_prepared *prepared = folder ? new_prepared(kind) : NULL;
    if (!prepared)
        return NULL;
    kmp_cached file = kmp_cache_read(folder, &key);
    kmp_byte_source source = kmp_byte_source_of(file.bytes, file.size);
    bool good = file.whole && kmp_prepared_take(&source, program, prepared);
    kmp_free(file.whole);
    if (good)
        return prepared;
    release(&prepared->form);
    return NULL;
}

const kmp_prepared *kmp_prepared_known(const kmp_program *program, kmp_code_form form, int threads)
{
    int kind = kmp_prepared_kind(form, threads);
    kmp_program_form *found = kmp_program_find_form(program, kind);
    if (found)
        return (const kmp_prepared *)found;
    kmp_prepared *made = recalled(program, kind);
    return made ? (const kmp_prepared *)kmp_program_add_form(program, &made->form) : NULL;
}

const kmp_prepared *kmp_prepared_of(const kmp_program *program, kmp_code_form form, int threads)
{
    const kmp_prepared *known = kmp_prepared_known(program, form, threads);
    kmp_prepared *made = known ? NULL : make(program, form, threads);
    return made ? (const kmp_prepared *)kmp_program_add_form(program, &made->form) : known;
}

bool kmp_prepared_frame(const kmp_prepared *prepared, kmp_frame *frame, kmp_team *team)
{
    *frame = prepared->frame;
    frame->team = team;
    frame->arena = frame->values = (kmp_arena){0};
    frame->v = NULL;
    frame->solving = NULL;
    return kmp_frame_add_blocks(frame);
}

bool kmp_prepared_values(const kmp_prepared *prepared, kmp_frame *frame)
{
    frame->v = kmp_arena_aligned(&frame->values, frame->slots);
    for (uint32_t k = 0; frame->v && k < prepared->start_count; k++)
        frame->v[prepared->start[k].slot] = prepared->start[k].value;
    return frame->v;
}
