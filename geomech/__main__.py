from geomech.shell.cli import main

main()
