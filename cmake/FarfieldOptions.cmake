# Refuses what the options cannot mean together, before anything is looked for.

if(FARFIELD_BUILD_EXAMPLES)
    foreach(part IN ITEMS IO OPENGL EVAL)
        if(NOT FARFIELD_BUILD_${part})
            message(
                FATAL_ERROR
                    "FARFIELD_BUILD_EXAMPLES needs FARFIELD_BUILD_${part}: set both to ON, or "
                    "FARFIELD_BUILD_EXAMPLES to OFF"
            )
        endif()
    endforeach()
endif()

set(farfield_sanitizers "" address undefined "address;undefined" thread)
if(NOT "${FARFIELD_SANITIZE}" IN_LIST farfield_sanitizers)
    message(
        FATAL_ERROR
            "FARFIELD_SANITIZE is '${FARFIELD_SANITIZE}'; it may be address, undefined, "
            "address;undefined or thread"
    )
endif()
