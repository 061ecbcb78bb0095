# What a shell wants of the programs: pages of the manual and completion, made by asking the built programs when they are installed.
# Left out where those do not run (cross-compiling) and pages without a Python.
find_package(Python3 COMPONENTS Interpreter QUIET)
set(shell_files ${CMAKE_CURRENT_BINARY_DIR}/shell)

# strata_manual(TARGET SECTION COMPONENT): pages of the program and of all its commands.
function(strata_manual target section component)
  if(CMAKE_CROSSCOMPILING OR NOT Python3_Interpreter_FOUND)
    message(STATUS "no pages of the manual for ${target}: that needs Python and a program that runs here")
    return()
  endif()
  set(pages ${shell_files}/${component}/man${section})
  install(
    CODE "execute_process(COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/reference/manual.py $<TARGET_FILE:${target}>
            --section ${section} --version \"Strata ${PROJECT_VERSION}\" --out ${pages} COMMAND_ERROR_IS_FATAL ANY)"
    COMPONENT ${component}
  )
  install(
    DIRECTORY ${pages}/
    DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section}
    COMPONENT ${component}
  )
endfunction()

strata_manual(strata_cli 1 client)
strata_manual(stratad 8 server)
if(TARGET strata_ros2_program)
  strata_manual(strata_ros2_program 1 ros2)
endif()

if(NOT CMAKE_CROSSCOMPILING)
  # shell, the file it looks for, where
  foreach(
    place
    "bash|strata|bash-completion/completions"
    "zsh|_strata|zsh/vendor-completions"
    "fish|strata.fish|fish/vendor_completions.d"
  )
    string(REPLACE "|" ";" place ${place})
    list(GET place 0 shell)
    list(GET place 1 name)
    list(GET place 2 folder)
    install(
      CODE "file(MAKE_DIRECTORY ${shell_files}/${shell})
            execute_process(COMMAND $<TARGET_FILE:strata_cli> completion ${shell} OUTPUT_FILE ${shell_files}/${shell}/${name}
              COMMAND_ERROR_IS_FATAL ANY)"
      COMPONENT client
    )
    install(
      FILES ${shell_files}/${shell}/${name}
      DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder}
      COMPONENT client
    )
  endforeach()
endif()
