/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The workbench: a page in a browser on this machine, in which a model file is edited and run.
 *
 *     kempe_workbench *workbench;
 *     kempe_workbench_new(context, "four_bar.yaml", NULL, "/usr/bin/kempe", 0, &workbench);
 *     puts(kempe_workbench_address(workbench));
 *     kempe_workbench_wait(workbench);
 *     kempe_workbench_free(workbench);
 *
 * Its server listens on 127.0.0.1, and answers only requests with the token of the address. It writes the model file,
 * reads a folder, and runs studies by the command kempe. docs/workbench_protocol.md has the requests of
 * the page. The dragging of mechanisms is separate:
 * without a server, a program gives the same requests to a kempe_drag.
 */
#ifndef KEMPE_WORKBENCH_H
#define KEMPE_WORKBENCH_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_workbench kempe_workbench;

/** Serves the page of a model file in separate threads. `folder`: files are read only in it, with its folders; NULL:
 * the folder of the file. `command`: the path of the command kempe. `port`: of 127.0.0.1, 0: any free one. The context
 * receives messages of this call and outlives the workbench. KEMPE_E_IO: the file cannot be read, or the port is taken.
 * KEMPE_E_ARGUMENT: the file is not in the folder, or libmicrohttpd is not installed. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workbench_new(kempe_context *context, const char *file, const char *folder,
                                           const char *command, int port, kempe_workbench **workbench);

/** Ends running commands and the server. */
KEMPE_API void kempe_workbench_free(kempe_workbench *workbench);

/** The address of the page, with its token: every program that knows it may edit and run the model. The workbench owns
 * it. */
KEMPE_API const char *kempe_workbench_address(const kempe_workbench *workbench);

/** Returns when kempe_context_interrupt was called for the context. */
KEMPE_API void kempe_workbench_wait(const kempe_workbench *workbench);

/** Mechanisms that follow a dragged point, each prepared once. */
typedef struct kempe_drag kempe_drag;

/** One without mechanisms. The texts of models count as the file of this path: what they include is relative to it. The
 * context receives messages and outlives it. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_drag_new(kempe_context *context, const char *file, kempe_drag **drag);
KEMPE_API void kempe_drag_free(kempe_drag *drag);

/** Answers a request in JSON, of docs/workbench_protocol.md: `*answer` is an object in JSON also after an error (free
 * with kempe_text_free). KEMPE_E_ARGUMENT: it is not such a request; KEMPE_E_INPUT: the model has an error, or the
 * session is not kept; KEMPE_E_FAILED: its loops cannot be closed; KEMPE_E_MEMORY, without an answer. */
KEMPE_API kempe_status kempe_drag_take(kempe_drag *drag, const char *request, char **answer);

KEMPE_END
#endif
