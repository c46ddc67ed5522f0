# What `cmake --install` lays down: libraries, header sets, and a package with one export file per
# component, so that a consumer needs the dependencies of what it asks for and no others.

option(FARFIELD_INSTALL "Rules for cmake --install" ${PROJECT_IS_TOP_LEVEL})

if(FARFIELD_INSTALL)
    include(GNUInstallDirs)
    include(CMakePackageConfigHelpers)

    set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/farfield")
    set(build_dir "${CMAKE_CURRENT_BINARY_DIR}/package")

    get_property(components GLOBAL PROPERTY FARFIELD_COMPONENTS)
    foreach(component IN LISTS components)
        get_target_property(target farfield::${component} ALIASED_TARGET)
        install(
            TARGETS ${target}
            EXPORT farfield-${component}
            ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
            LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
            RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}"
            FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
        )
        install(
            EXPORT farfield-${component}
            FILE farfield-${component}-targets.cmake
            NAMESPACE farfield::
            DESTINATION "${package_dir}"
        )
        install(FILES "cmake/package/farfield-${component}.cmake" DESTINATION "${package_dir}")
    endforeach()

    configure_package_config_file(
        cmake/package/farfield-config.cmake.in "${build_dir}/farfield-config.cmake"
        INSTALL_DESTINATION "${package_dir}"
    )
    write_basic_package_version_file(
        "${build_dir}/farfield-config-version.cmake" COMPATIBILITY SameMinorVersion
    )
    # The pkg-config file finds its prefix from where it lies, so that an installation can move.
    file(
        RELATIVE_PATH pc_prefix "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" "${CMAKE_INSTALL_PREFIX}"
    )
    file(RELATIVE_PATH pc_libdir "${CMAKE_INSTALL_PREFIX}" "${CMAKE_INSTALL_FULL_LIBDIR}")
    file(RELATIVE_PATH pc_includedir "${CMAKE_INSTALL_PREFIX}" "${CMAKE_INSTALL_FULL_INCLUDEDIR}")
    configure_file(cmake/package/farfield.pc.in "${build_dir}/farfield.pc" @ONLY)
    install(
        FILES "${build_dir}/farfield-config.cmake" "${build_dir}/farfield-config-version.cmake"
        DESTINATION "${package_dir}"
    )
    install(FILES "${build_dir}/farfield.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
    install(FILES LICENSE README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
endif()

# These look at the project as a whole, its layout and what it installs, and so come last.
if(FARFIELD_BUILD_TESTS)
    add_subdirectory(tests/architecture)
    if(FARFIELD_INSTALL AND NOT FARFIELD_SANITIZE)
        add_subdirectory(tests/package)
    endif()
endif()
