# SPDX-License-Identifier: BSD-3-Clause
# The command as a module of WebAssembly (packaging/build_wasm): its files are in memory, its memory grows, and javascript/kempe.mjs
# calls it with the words of one command.
target_link_options(kempe_command PRIVATE -Os -Wl,--wrap=fma -sMODULARIZE=1 -sEXPORT_NAME=kempeModule -sINVOKE_RUN=0 -sEXPORTED_RUNTIME_METHODS=FS,callMain
    -sALLOW_MEMORY_GROWTH=1 -sALLOW_TABLE_GROWTH=1 -sMAXIMUM_MEMORY=4GB -sTOTAL_STACK=2MB -sFILESYSTEM=1 -sENVIRONMENT=web,worker -sINCOMING_MODULE_JS_API=instantiateWasm,print,printErr,onAbort,onExit,progress,noInitialRun
    -sEXIT_RUNTIME=0)
set_target_properties(kempe_command PROPERTIES OUTPUT_NAME kempe_module SUFFIX .js)
if(KEMPE_WORKBENCH) # a page drags mechanisms, and asks about its text, without a command
    target_link_options(kempe_command PRIVATE -sEXPORTED_FUNCTIONS=_main,_malloc,_free,_kempe_context_new,_kempe_text_free,_kempe_drag_new,_kempe_drag_take,_kempe_language_server_new,_kempe_language_server_take
        -sEXPORTED_RUNTIME_METHODS=FS,callMain,UTF8ToString,stringToUTF8,lengthBytesUTF8)
endif()
