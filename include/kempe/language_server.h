/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Model files in editors: a server of the Language Server Protocol 3.17. It takes bytes of a client and gives bytes to
 * be sent back, so that its user has any channel; `kempe language-server` has its standard input and output.
 *
 *     kempe_language_server *server;
 *     kempe_language_server_new(context, &server);
 *     while (kempe_language_server_is_running(server) && (count = read(0, bytes, sizeof bytes)) > 0) {
 *         kempe_language_server_take(server, bytes, (size_t)count, &answer);
 *         .. write the text `answer`, which may be empty ..
 *         kempe_text_free(answer);
 *     }
 *     kempe_language_server_free(server);
 *
 * It reads the files that a model names, and writes none. After kempe_context_set_folder it reads only files of that
 * folder. A server belongs to one thread.
 */
#ifndef KEMPE_LANGUAGE_SERVER_H
#define KEMPE_LANGUAGE_SERVER_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_language_server kempe_language_server;

/** A server without documents. The context receives messages and outlives the server. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_language_server_new(kempe_context *context, kempe_language_server **server);
KEMPE_API void kempe_language_server_free(kempe_language_server *server);

/** Takes the next `count` bytes of the client, at any borders, and answers the messages that are complete with them:
 * `*answer` is what is to be sent, headers included, "" for nothing (free with kempe_text_free). A message that is
 * wrong is answered by an error of JSON-RPC. KEMPE_E_INPUT: the headers are not of the protocol, and the server has
 * ended; KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_language_server_take(kempe_language_server *server, const char *bytes, size_t count,
                                                  char **answer);

/** 1 until the client says `exit`. Then the server is finished, 1, where `shutdown` came before, and its program ends
 * with the code 0; otherwise 0, and it ends with 1. */
KEMPE_API int kempe_language_server_is_running(const kempe_language_server *server);
KEMPE_API int kempe_language_server_is_finished(const kempe_language_server *server);

KEMPE_END
#endif
