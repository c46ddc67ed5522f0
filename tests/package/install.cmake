# Installs ${build} into ${prefix}, from nothing: a file left by an earlier run must not stand in
# for one that is no longer installed.
file(REMOVE_RECURSE "${prefix}")
execute_process(
    COMMAND "${CMAKE_COMMAND}" --install "${build}" --prefix "${prefix}"
    COMMAND_ERROR_IS_FATAL ANY
)
