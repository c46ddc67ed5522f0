# Refuses what the options cannot mean together, before anything is looked for.

if(FARFIELD_BUILD_EXAMPLES)
    foreach(part IN ITEMS IO OPENGL EMBREE PARALLEL EVAL)
        if(NOT FARFIELD_BUILD_${part})
            message(
                FATAL_ERROR
                    "FARFIELD_BUILD_EXAMPLES needs FARFIELD_BUILD_${part}: set both to ON, or "
                    "FARFIELD_BUILD_EXAMPLES to OFF"
            )
        endif()
    endforeach()
endif()

foreach(sanitizer IN LISTS FARFIELD_SANITIZE)
    if(NOT sanitizer MATCHES "^(address|undefined|thread)$")
        message(
            FATAL_ERROR
                "FARFIELD_SANITIZE names '${sanitizer}'; it may name address, undefined and thread"
        )
    endif()
endforeach()
